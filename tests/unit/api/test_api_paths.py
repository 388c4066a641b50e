"""Paths of fields, and `Pruned`: a job's data from which wrong values are removed."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.api import TrainingJob
from palaestra.api.container import Variable
from palaestra.api.model_walk import model_at, walk
from palaestra.api.paths import Pruned, path_of, shown
from palaestra.api.simulators import WorldSource


@pytest.mark.parametrize(
    ("path", "text"),
    [
        (("spec", "simulators", 1, "role"), "spec.simulators[1].role"),
        (("metadata", "labels", "a.b/c"), 'metadata.labels["a.b/c"]'),
        (('say "x"',), '["say \\"x\\""]'),
        ((), ""),
    ],
)
def test_a_path_is_shown_as_a_person_writes_it(path, text) -> None:
    """Authors find the field in their file by this path.

    It has dots between words, numbers in brackets, and quotes around the rest.
    """
    assert shown(path) == text


PIECES = st.integers(0, 99) | st.text(max_size=4) | st.from_regex(r"[a-z_]{1,4}", fullmatch=True)


@given(st.lists(PIECES, min_size=1).map(tuple))
def test_a_path_is_read_as_it_is_shown(path) -> None:
    """A user can copy a path from a message into a command."""
    assert path_of(shown(path)) == path


@pytest.mark.parametrize("text", ["", ".a", "a..b", "a.", "a[", "a[-1]", 'a["b]', 'a["\\x"]', "a-b"])
def test_a_text_that_is_no_path_is_empty(text) -> None:
    """For a mistyped text, `path_of` returns an empty path, and no field has an empty path."""
    assert path_of(text) == ()


def test_what_is_left_of_a_list_knows_its_old_numbers() -> None:
    """A mistake in the third group is reported for the third group, even if the first group was removed."""
    pruned = Pruned({"groups": ["a", "b", {"role": "c"}]})

    pruned.take(("groups", 0))

    assert pruned.data() == {"groups": ["b", {"role": "c"}]}
    assert pruned.original(("groups", 1, "role")) == ("groups", 2, "role")


def test_what_is_not_there_cannot_be_taken() -> None:
    """`take` returns False for a missing path, so that the caller can remove the parent object."""
    pruned = Pruned({"a": {"b": 1}})

    assert not pruned.take(("a", "c"))
    assert not pruned.take(("x", "y"))
    assert not pruned.take(("a", "b", "c"))
    assert pruned.data() == {"a": {"b": 1}}


def test_a_stand_in_is_put_once() -> None:
    """`take` replaces a wrong value by a valid stand-in, so that the other fields can be checked.

    A second error at this path is an error of the stand-in itself, so `take` returns False.
    """
    pruned = Pruned({"metadata": 3})

    assert pruned.take(("metadata",), {"name": "stand-in"})
    assert not pruned.take(("metadata",), {"name": "stand-in"})
    assert pruned.data() == {"metadata": {"name": "stand-in"}}


JSON = st.recursive(
    st.integers(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=3), inner),
    max_leaves=8,
)


@given(JSON)
def test_nothing_taken_is_everything_left(data) -> None:
    """A job without errors must be validated as its author wrote it."""
    assert Pruned(data).data() == data


def test_the_model_at_a_path_is_found_through_lists() -> None:
    """The proposed field names come from the model at the path of the mistake."""
    assert model_at(TrainingJob, ("spec", "simulators", 3, "world")) is WorldSource
    assert model_at(TrainingJob, ("spec", "trainer", "env", 0)) is Variable
    assert model_at(TrainingJob, ("spec", "seed")) is None
    assert model_at(TrainingJob, ("spec", "nowhere", "else")) is None


def test_the_tree_of_models_begins_with_the_job_itself() -> None:
    """A rule may be at any depth, so the walk must reach the most deeply nested model."""
    paths = [path for path, _ in walk(TrainingJob)]

    assert paths[0] == ()
    assert ("spec", "simulators", "env", "secretKeyRef") in paths
