"""A job file is read as a Kubernetes client reads it; ambiguous YAML is refused with its position."""

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from palaestra.api.yaml_io import NotYaml, read, write


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("5e-4", 0.0005),
        ("1e3", 1000.0),
        (".5", 0.5),
        ("1.", 1.0),
        ("+1", 1),
        ("1_000", 1000),
        ("010", 8),
        ("0x1f", 31),
        ("1:30", "1:30"),
        ("2026-01-31", "2026-01-31"),
        ("1.5.2", "1.5.2"),
        ("0x", "0x"),
        ("no", False),
        ("On", True),
        ("n", "n"),
        ("~", None),
        ("", None),
        ("'5'", "5"),
        ('"no"', "no"),
    ],
)
def test_a_scalar_is_what_a_cluster_takes_it_for(text, value) -> None:
    """The same file must mean the same here and in a cluster.

    `5e-4` is a number, but `1:30` is not the number 90, and a date stays text.
    """
    found = read(f"a: {text}", "job.yaml")["a"]

    assert (found, type(found)) == (value, type(value))


def test_anchors_and_merges_are_followed() -> None:
    """Authors use anchors to avoid repetition. A mapping's own key overrides a merged key."""
    text = "a: &a {x: 1, y: 2}\nb: {<<: *a, y: 3}\nc: {<<: [{x: 5}, *a]}\n"

    assert read(text, "job.yaml") == {
        "a": {"x": 1, "y": 2},
        "b": {"x": 1, "y": 3},
        "c": {"x": 5, "y": 2},
    }


@pytest.mark.parametrize(
    ("text", "problem"),
    [
        ("a: 1\na: 2", "2:1: duplicate key a; keep one"),
        ("x:\n  on: 1", '2:3: the key on is not text; quote it: "on"'),
        ("[1]: 2", "1:1: a key is a list or a mapping; use text as the key"),
        ("a: .inf", "1:4: .inf is not a finite number; use a finite one"),
        ("a: 1e999", "1:4: 1e999 is not a finite number; use a finite one"),
        ("a: {<<: 3}", "1:9: << needs a mapping; refer to one with *"),
        ("a: 1\n---\nb: 1", "2:1: a second document begins here; put one TrainingJob in a file"),
        ("a: \x07", "1:4: YAML does not allow this character; remove it"),
        ("a: !!int x", "1:4: the value does not match its tag, or is too large; correct it"),
        (f"a: {'9' * 5000}", "1:4: the value does not match its tag, or is too large; correct it"),
        (
            "a: !!binary eA==",
            "1:4: the tag tag:yaml.org,2002:binary is not allowed in job files; remove it",
        ),
        (
            "a: !!python/name:os.system x",
            "1:4: the tag tag:yaml.org,2002:python/name:os.system is not allowed in job files; remove it",
        ),
        (
            "a: b: c",
            "1:5: not YAML: mapping values are not allowed here; correct the line or quote the text",
        ),
    ],
)
def test_the_error_for_text_that_cannot_be_read_has_line_and_column(text, problem) -> None:
    """Line and column are counted from 1, as in editors."""
    with pytest.raises(NotYaml) as caught:
        read(text, "job.yaml")

    assert caught.value.problem == f"job.yaml:{problem}"


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("&a [*a]", "is nested too deeply, or contains itself"),
        ("[" * 1500, "is nested too deeply, or contains itself"),
        ("x" * 1_500_001, "is longer than 1500000 characters"),
    ],
)
def test_a_document_without_end_is_refused(text, fact) -> None:
    """A job file must not exhaust the memory of the program that reads it."""
    with pytest.raises(NotYaml, match=f"^job.yaml: {fact}"):
        read(text, "job.yaml")


def test_aliases_count_as_often_as_they_are_used() -> None:
    """Nine lines of aliases can expand to a billion values, so the limit must count each use of an alias."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{n}: &a{n} [{', '.join([f'*a{n - 1}'] * 10)}]" for n in range(1, 9)]

    with pytest.raises(NotYaml, match="more than 50000 values; shorten the file"):
        read("\n".join(lines), "job.yaml")


@given(st.text())
def test_any_text_is_read_or_refused_with_the_file_s_name(text) -> None:
    """For any text, the reader returns a value or raises `NotYaml`, and no other error."""
    try:
        read(text, "job.yaml")
        problem = "job.yaml: none"
    except NotYaml as error:
        problem = error.problem

    assert problem.startswith("job.yaml:")
    assert "\n" not in problem


PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(st.characters(exclude_categories=["Cs"])),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text("abc.5e-no", max_size=5),
                                                                inner, max_size=4),
    max_leaves=12,
)  # fmt: skip


@given(PLAIN)
def test_what_is_written_is_read_as_the_same(data) -> None:
    """`write` quotes texts that look like another type, such as `5e-4` and `no`."""
    assert read(write(data), "job.yaml") == data


@pytest.mark.parametrize("text", ["5e-4", "1:30", "no", "~", "2026-01-31", "\x85", "a\u2028b", "\r", " a\n"])
def test_a_text_stays_a_text_when_it_is_written(text) -> None:
    """Neither this reader nor a YAML 1.1 parser reads the text as another type."""
    written = write({"value": text})

    assert read(written, "job.yaml") == {"value": text}
    assert yaml.safe_load(written) == {"value": text}
