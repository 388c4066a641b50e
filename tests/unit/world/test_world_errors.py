"""Each invalid world is rejected with a WorldError that has the position, the fact and the remedy."""

import pickle
from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.world import RunIdentity, WorldError, builtin, check, generate, parse

IDENTITY = RunIdentity(job="job", replica=0, group="collect", index=0)


def refusal(source: bytes) -> str:
    """Return the message about a world that cannot be read."""
    with pytest.raises(WorldError) as caught:
        parse(source, "arena.wbt")
    return str(caught.value)


def problem(attempt: Callable[[], object]) -> WorldError | None:
    """Return the WorldError that a call raises, or None; any other exception fails the test."""
    try:
        attempt()
    except WorldError as error:
        return error
    return None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Robot {", '2:7: the "{" of Robot is never closed; add the missing "}"'),
        ("Group {\n children [", '3:11: the "[" of children is never closed; add the missing "]"'),
        ("}", "2:1: found } where the type of a node should be; remove it or add what is missing"),
        ("{ }", "2:1: found { where the type of a node should be"),
        ("Group { children [ { } ] }", "2:20: found { where a value of children should be; write a value"),
        ("42", "2:1: found 42 where the type of a node should be"),
        ('Robot { } "a"', '2:11: found "a" where the type of a node should be'),
        ("Robot ]", '2:7: found ] where the "{" of Robot should be; a node is written Type { … }'),
        (
            'externproto "a"',
            '2:13: found "a" where the "{" of externproto should be; write EXTERNPROTO in capital',
        ),
        ("def R Robot { }", '2:5: found R where the "{" of def should be; write DEF in capital letters'),
        ("Robot", '2:6: found the end of the file where the "{" of Robot should be'),
        ("Robot { name }", "2:14: found } where a value of name should be; write a value"),
        ("Robot { name", "2:13: found the end of the file where a value of name should be"),
        ('Robot { "name" }', '2:9: found "name" where a field of Robot should be'),
        ('Robot { name "a" "b" }', '2:18: found "b" where a field of Robot should be'),
        ("Robot { TRUE }", "2:9: found TRUE where a field of Robot should be"),
        ("Robot { a.b 1 }", "2:9: found a.b where a field of Robot should be"),
        ('Robot { name"a" }', '2:9: found name"a" where a field of Robot should be'),
        ("Robot { 'a' 1 }", "2:9: found 'a' where a field of Robot should be"),
        ("DEF Robot { }", "2:11: found { where the type of a node should be"),
        ("DEF { }", "2:5: found { where a DEF name after DEF should be"),
        ("USE { }", "2:5: found { where a DEF name after USE should be"),
        ("Robot { name IS name }", "2:14: found IS outside a PROTO file; write the value of name"),
        ("PROTO Robot [ ] { }", "2:1: found PROTO where the type of a node should be"),
        ("EXTERNPROTO Robot", "2:13: found Robot where the address of an EXTERNPROTO should be"),
        ("EXTERNPROTO", "2:12: found the end of the file where the address of an EXTERNPROTO should be"),
        ("IMPORTABLE Robot { }", "2:12: found Robot where EXTERNPROTO should be; only an EXTERNPROTO"),
        ('Robot { name "a" name "b" }', "2:18: Robot has the field name twice; keep one of them"),
        ('Robot {\n  name "a\n}', '3:8: this string is not closed on its line; add the missing "'),
        ("Grüße 1", '2:7: found 1 where the "{" of Grüße should be'),
        ("x" * 99, f'2:100: found the end of the file where the "{{" of {"x" * 99} should be'),
        ("[" + "x" * 99, "2:1: found [ where the type of a node should be"),
        ('"' + "x" * 99 + '"', f'2:1: found "{"x" * 39}… where the type of a node should be'),
    ],
)
def test_a_mistake_is_pointed_at(world: Callable[[str], bytes], text: str, message: str) -> None:
    """Lines and columns count from 1, and columns count characters, as in an editor."""
    assert refusal(world(text)).startswith(f"arena.wbt:{message}")


@pytest.mark.parametrize(
    "first_line",
    [b"", b"Robot { }", b"#VRML V2.0 utf8", b"#VRML_SIM", b"#VRML_SIM utf8", b" #VRML_SIM R2023b"],
)
def test_a_file_without_the_header_of_a_world_is_refused(first_line: bytes) -> None:
    """Webots rejects such a file too."""
    assert refusal(first_line + b"\n") == (
        "arena.wbt:1:1: the first line is not the header of a Webots world; make it #VRML_SIM R2023b utf8"
    )


def test_a_byte_that_is_not_utf_8_is_pointed_at(world: Callable[[str], bytes]) -> None:
    """The column counts each character before that byte as one, however many bytes it has."""
    assert refusal(world("# ü ") + b"\xff\n") == (
        "arena.wbt:2:5: byte 0xff is not UTF-8; save the world as UTF-8"
    )


def test_nodes_a_hundred_deep_are_read_and_more_are_refused(world: Callable[[str], bytes]) -> None:
    """Palaestra's own limit comes before Python's recursion limit."""
    deepest = "Group { children " * 99 + "Group { }" + " }" * 99

    assert len(list(parse(world(deepest)).walk())) == 100
    assert "nodes are nested more than 100 deep" in refusal(world("Group { children " * 100_000))


def test_an_error_can_be_taken_apart_and_sent_on() -> None:
    """A tool that shows errors in an editor needs line and column, and a process pool pickles the error."""
    error = WorldError("arena.wbt", 12, 5, "this is wrong", "do that")

    copy = pickle.loads(pickle.dumps(error))

    assert (copy.world, copy.line, copy.column) == ("arena.wbt", 12, 5)
    assert (copy.fact, copy.remedy) == ("this is wrong", "do that")
    assert str(copy) == "arena.wbt:12:5: this is wrong; do that"
    assert isinstance(copy, ValueError)


@given(st.binary())
def test_arbitrary_bytes_are_a_world_or_a_world_error(data: bytes) -> None:
    """For any bytes, the reader raises no other exception than WorldError."""
    error = problem(lambda: parse(b"#VRML_SIM R2023b utf8\n" + data))

    assert error is None or (error.line >= 1 and error.column >= 1)


@given(
    at=st.floats(0, 1),
    cut=st.integers(0, 400),
    new=st.one_of(
        st.binary(max_size=4),
        st.sampled_from([b'"', b"{", b"}", b"[", b"]", b"USE ", b"DEF A ", b" IS ", b"#", b"\r\n"]),
    ),
)
def test_a_damaged_world_is_generated_from_or_refused(at: float, cut: int, new: bytes) -> None:
    """The file may be half saved or lack braces. `check` must find the same mistake as `generate`."""
    arena = builtin("two_robots")
    place = int(at * len(arena))
    damaged = arena[:place] + new + arena[place + cut :]

    error = problem(lambda: generate(damaged, IDENTITY, clock=True))

    assert error is None or str(error).startswith(f"world:{error.line}:{error.column}: ")
    assert str(problem(lambda: check(damaged))) == str(error)
