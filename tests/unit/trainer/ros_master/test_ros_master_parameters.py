"""The tree of parameters. tests/contract compares the responses with those of rosmaster."""

import copy

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.ros_master.parameters import Parameters, changes

NAMES = st.lists(st.sampled_from("abc"), min_size=1, max_size=3).map(lambda parts: "/" + "/".join(parts))
LEAVES = st.one_of(st.integers(), st.text(max_size=3), st.lists(st.integers(), max_size=2))
VALUES = st.recursive(
    LEAVES, lambda inner: st.dictionaries(st.sampled_from("abc"), inner, max_size=2), max_leaves=4
)
SET = st.lists(st.tuples(NAMES, VALUES), max_size=6)


def made(settings):
    """Return parameters that were set in this order."""
    parameters = Parameters()
    for name, value in settings:
        parameters.set(name, value)
    return parameters


@given(SET, NAMES, VALUES)
def test_a_parameter_has_the_value_that_was_set_and_is_gone_once_deleted(settings, name, value):
    """Earlier values have no effect, even a plain value where the new name needs a namespace."""
    parameters = made(settings)

    parameters.set(name, value)
    assert parameters.get(name) == value
    parameters.delete(name)
    assert not parameters.has(name)
    with pytest.raises(KeyError):
        parameters.delete(name)


@given(SET, SET)
def test_a_tree_that_was_returned_never_changes(before, after):
    """A response with the tree may still be on its way while another program sets parameters."""
    parameters = made(before)
    returned = parameters.get("/")
    kept = copy.deepcopy(returned)

    for name, value in after:
        parameters.set(name, value)
        parameters.delete(name)

    assert returned == kept


@given(SET)
def test_every_name_is_that_of_a_value(settings):
    """`names` returns parameters only, not their namespaces."""
    parameters = made(settings)

    names = parameters.names()

    assert len(set(names)) == len(names)
    assert not any(isinstance(parameters.get(name), dict) for name in names)


def test_a_search_goes_up_to_the_root_and_only_looks_for_the_first_part():
    """As in ROS, only the first part of the name must exist. The rest may be set later."""
    parameters = made([("/robot/base/width", 1), ("/base", 2)])

    assert parameters.search("base/none", "/robot/arm/hand") == "/robot/base/none"
    assert parameters.search("base", "/other") == "/base"
    assert parameters.search("none", "/robot") is None
    with pytest.raises(ValueError, match="cannot be searched for"):
        parameters.search("~base", "/robot")


def test_a_root_that_is_no_dictionary_is_refused():
    """The root contains all namespaces, so it must stay a dictionary."""
    with pytest.raises(TypeError, match="must be a dictionary"):
        Parameters().set("/", 5)


def test_a_change_reaches_subscribers_above_below_and_of_the_name_itself():
    """A replaced namespace deletes the parameters that its new value lacks."""
    found = {
        it.subscribed: it[1:] for it in changes("/r", {"x": 1}, ["/", "/r/", "/r/x/", "/r/y/", "/other/"])
    }

    assert found == {
        "/": ("/r/", {"x": 1}, True),
        "/r/": ("/r/", {"x": 1}, True),
        "/r/x/": ("/r/x/", 1, False),
        "/r/y/": ("/r/y/", {}, False),
    }
