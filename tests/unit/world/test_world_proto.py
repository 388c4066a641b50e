"""PROTO files without a template are read; others are rejected with position, fact and remedy."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.world import Is, Node, Proto, WorldError, parse, parse_proto

HEADER = "#VRML_SIM R2023b utf8\n"
STOOL = """# A stool of three legs.
EXTERNPROTO "Leg.proto"
EXTERNPROTO "webots://projects/appearances/protos/Pine.proto"

PROTO Stool [
  field          SFVec3f            translation 0 0 0.5    # of the seat
  field          SFRotation         rotation    0 0 1 0
  field          SFString{"a", "b"} name        "a"
  vrmlField      SFBool             locked      FALSE
  hiddenField    MFFloat            angles      [ 0, 1.5 ]
  unconnectedField MFNode{Leg{}}    legs        [ Leg { } Leg { } ]
  deprecatedField SFNode            look        NULL
  field          MFString           texture     "pine.jpg"
]
{
  Solid {
    translation IS translation
    children [
      Shape { appearance IS look }
      Group { children IS legs }
    ]
    name IS name
  }
}
"""


def read(text: str) -> Proto:
    """Return the PROTO of a text that lacks the header."""
    return parse_proto((HEADER + text).encode(), "Stool.proto")


def refusal(text: str) -> str:
    """Return the message about a PROTO that cannot be read."""
    with pytest.raises(WorldError) as caught:
        read(text)
    return str(caught.value).removeprefix("Stool.proto:")


def declaring(declaration: str) -> str:
    """Return a PROTO with one field declaration, on line 3."""
    return f"PROTO Stool [\n{declaration}\n] {{ Solid {{ }} }}"


def test_a_proto_has_its_type_fields_files_and_body() -> None:
    """Webots lists the fields in their declared order, so the reader keeps it."""
    stool = read(STOOL)

    assert stool.name == "Stool"
    assert list(stool.fields) == [
        *("translation", "rotation", "name", "locked", "angles", "legs", "look", "texture"),
    ]
    assert [token.text for token in stool.externs] == [
        b'"Leg.proto"',
        b'"webots://projects/appearances/protos/Pine.proto"',
    ]
    assert stool.body.type_name == "Solid"
    assert stool.source.data.startswith(HEADER.encode())


def test_a_field_has_its_type_access_default_and_allowed_values() -> None:
    """As in a world, a list of one value needs no brackets."""
    fields = read(STOOL).fields

    assert (fields["translation"].type, fields["translation"].default.items) == ("SFVec3f", (0, 0, 0.5))
    assert (fields["angles"].access, fields["angles"].default.items) == ("hiddenField", (0, 1.5))
    assert fields["name"].allowed == ("a", "b")
    assert fields["look"].default.items == (None,)
    assert fields["texture"].default.items == ("pine.jpg",)
    assert [leg.type_name for leg in fields["legs"].default.items if isinstance(leg, Node)] == ["Leg", "Leg"]


def test_is_refers_to_a_field_of_the_proto() -> None:
    """The reader does not replace IS by a value, because only an instance has the value."""
    body = read(STOOL).body

    assert body.fields["translation"].items == (Is(name="translation"),)
    assert body.nodes("children")[1].fields["children"].items == (Is(name="legs"),)
    assert body.numbers("translation") is None


def test_a_world_still_has_no_is() -> None:
    """IS refers to a field that a PROTO declares, and a world declares no fields."""
    with pytest.raises(
        WorldError, match="2:21: found IS outside a PROTO file; write the value of translation"
    ):
        parse(f"{HEADER}Solid {{ translation IS place }}".encode())


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "2:1: found the end of the file where PROTO should be; a PROTO file has one PROTO"),
        ("Solid { }", "2:1: found Solid where PROTO should be"),
        ("PROTO { }", "2:7: found { where the type of the PROTO should be"),
        (
            "PROTO Stool { Solid { } }",
            "2:13: found { where [ should be; the fields of a PROTO are declared in",
        ),
        ("PROTO Stool [", '2:13: the "[" of Stool is never closed; add the missing "]"'),
        ("PROTO Stool [ ] Solid { }", "2:17: found Solid where { should be; the body of a PROTO is written"),
        ("PROTO Stool [ ] { }", "2:19: found } where the type of a node should be"),
        (
            "PROTO Stool [ ] { USE A }",
            "2:19: found a USE where the node of Stool should be; write the node out",
        ),
        (
            "PROTO Stool [ ] { Solid { } Solid { } }",
            "2:29: found Solid where } should be; a PROTO has one node",
        ),
        ("PROTO Stool [ ] { Solid { } } PROTO", "2:31: found PROTO after the end of the PROTO; remove it"),
        (
            "EXTERNPROTO Leg PROTO Stool [ ] { }",
            "2:13: found Leg where the address of an EXTERNPROTO should be",
        ),
        (
            declaring("exposedField SFBool a TRUE"),
            "3:1: found exposedField where a field of Stool should be decl",
        ),
        (
            declaring("field SFVec4f a 0"),
            "3:7: found SFVec4f where the type of a field of Stool should be; write",
        ),
        (declaring("field SFBool 1 TRUE"), "3:14: found 1 where the name of a SFBool of Stool should be"),
        (declaring('field SFString{"a" x "b"'), '3:22: found "b" where the "{" of x should be'),
        ('PROTO Stool [ field SFString{"a"', '2:29: the "{" of SFString is never closed'),
        (declaring("field SFVec3f a 0 0"), "3:17: the default of a is not of type SFVec3f; write 0 0 0"),
        (declaring("field SFVec3f a [ 0 0 0 ]"), "3:17: the default of a is not of type SFVec3f"),
        (
            declaring("field MFVec2f a [ 0 0 0 ]"),
            "3:17: the default of a is not of type MFVec2f; write [ 0 0 ]",
        ),
        (declaring("field SFBool a 1"), "3:16: the default of a is not of type SFBool; write TRUE"),
        (declaring("field SFNode a FALSE"), "3:16: the default of a is not of type SFNode; write NULL"),
        (
            declaring("field MFString a [ 1 ]"),
            '3:18: the default of a is not of type MFString; write [ "text" ]',
        ),
        (
            declaring("field SFBool a IS b"),
            "3:16: found IS outside the body of the PROTO; write the value of a",
        ),
        (declaring("field SFBool a TRUE\nfield SFBool a TRUE"), "4:1: Stool declares the field a twice"),
        (
            "PROTO Stool [ ] {\n Solid { translation IS place } }",
            "3:22: Stool has no field place; declare it, or write the value of translation",
        ),
    ],
)
def test_a_mistake_is_pointed_at(text: str, message: str) -> None:
    """A message begins with the line and the column in the PROTO's own file."""
    assert refusal(text).startswith(message)


def test_every_is_without_a_field_is_named_at_once() -> None:
    """A person who renames a field often has to correct several places."""
    message = refusal("PROTO Stool [ ] { Solid { name IS a model IS b } }")

    assert "no field a" in message
    assert "no field b" in message


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("PROTO Stool [ ]\n{\n  %<\n for (let a = 1;;) {}\n  >%\n  Solid { }\n}", 4),
        ("PROTO Stool [ ]\n{\n  %{ local a = 1 }%\n  Solid { }\n}", 4),
        ('PROTO Stool [ ]\n{ Solid { name "%<= fields.a.value >%" } }', 3),
        ("PROTO Stool [ %< >% ]\n{ Solid { } }", 2),
    ],
)
def test_a_template_is_refused_with_its_line_and_the_remedies(text: str, line: int) -> None:
    """Only an interpreter of Lua or JavaScript could run any code of a template."""
    message = refusal(text)

    assert message.startswith(f"{line}:")
    assert "this PROTO has a template with code that is not expanded (" in message
    assert message.endswith("; add this type to a file of stand-ins, or leave it out")


def test_a_percent_sign_in_a_comment_or_alone_is_no_template() -> None:
    """Comments contain percentages, and addresses contain escapes such as %20."""
    text = 'PROTO Stool [ ] # 5 %{ of all\n{ Solid { name "%20" } } # %<'

    assert read(text).body.text("name") == "%20"


def test_the_first_line_of_a_proto_is_checked_as_that_of_a_world() -> None:
    """A person must see in the message that the file should be a PROTO and not a world."""
    with pytest.raises(WorldError, match="the first line is not the header of a Webots PROTO"):
        parse_proto(b"PROTO Stool [ ] { Solid { } }", "Stool.proto")
    with pytest.raises(WorldError, match="save the PROTO as UTF-8"):
        parse_proto(HEADER.encode() + b"\xff", "Stool.proto")


def problem(data: bytes) -> WorldError | None:
    """Return the error about a PROTO; any other exception fails the test."""
    try:
        parse_proto(data, "Stool.proto")
    except WorldError as error:
        return error
    return None


@given(st.binary())
def test_arbitrary_bytes_are_a_proto_or_a_world_error(data: bytes) -> None:
    """For any bytes, the reader raises no other exception than WorldError."""
    error = problem(HEADER.encode() + data)

    assert error is None or (error.line >= 1 and error.column >= 1)


@given(
    at=st.floats(0, 1),
    cut=st.integers(0, 200),
    new=st.sampled_from(["", '"', "{", "}", "[", "]", " IS ", "#", "\r\n", "%", "%<", " field ", "SFBool"]),
)
def test_a_damaged_proto_is_read_or_refused(at: float, cut: int, new: str) -> None:
    """The file may be half saved or lack braces."""
    place = int(at * len(STOOL))
    damaged = STOOL[:place] + new + STOOL[place + cut :]

    error = problem((HEADER + damaged).encode())

    assert error is None or error.line >= 1


def test_of_two_values_of_a_field_in_a_body_the_last_counts() -> None:
    """Published PROTOs have such fields, and Webots reads them. A world with two values is still rejected."""
    proto = read("PROTO Stool [ field SFVec3f at 1 1 1 ] { Solid { translation IS at translation 0 0 2 } }")

    assert proto.body.numbers("translation") == (0, 0, 2)
