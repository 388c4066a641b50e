"""The data sheet of a policy: its spaces, and the tables in the docstring of its environment."""

from __future__ import annotations

import numpy as np
import pytest
from gymnasium import spaces

from palaestra_trainer.environments.data_sheet import MOST_BOUNDS, describe, tables_of
from palaestra_trainer.job.configuration import Environment
from tests.unit.trainer.environments.hall import NAME, Hall

TABLE = [{"index": "0", "meaning": "position"}]


class Documented(Hall):
    """An environment with a table.

    # Observation

    | index | meaning |
    |---|---|
    | 0 | position |
    """


class Shelf:
    """A class with a table, which is not an environment.

    # Observation

    | index | meaning |
    |---|---|
    | 0 | position |
    """


def made_by_function(robot, scene) -> Documented:
    """Return the environment, without a table of its own."""
    return Documented(robot, scene)


def made_without_types(robot, scene):
    """Return the environment.

    # Observation

    | index | meaning |
    |---|---|
    | 0 | position |
    """
    return Documented(robot, scene)


@pytest.mark.parametrize("creator", [Documented, made_by_function, made_without_types])
def test_the_tables_are_found_by_the_class_or_by_the_function_that_makes_it(register, creator):
    """An author may register a function; its return type names the class that has the docstring."""
    register(creator)

    assert tables_of(Environment(id=NAME)) == {"observation": [TABLE], "action": []}


@pytest.mark.parametrize("changes", [{"frame_stack": 2}, {"wrappers": ("hall:Mirror",)}])
def test_an_environment_with_wrappers_has_no_tables(register, changes):
    """The numbers that the policy gets are not those of the table any more."""
    register(Documented)

    assert tables_of(Environment(id=NAME).model_copy(update=changes)) == {"observation": [], "action": []}


def test_an_environment_that_cannot_be_imported_here_has_no_tables(register):
    """A package is also read on a robot's computer, which does not have the author's code."""
    register("not_installed_here:Hall")

    assert tables_of(Environment(id=NAME)) == {"observation": [], "action": []}


def test_a_function_that_returns_no_environment_has_no_docstring(register):
    """A wrong annotation must not put the tables of another class into the sheet."""

    def wrong(robot, scene) -> Shelf:
        del robot, scene

    register(wrong)

    assert tables_of(Environment(id=NAME)) == {"observation": [], "action": []}


def test_a_space_with_different_bounds_lists_them_and_a_large_one_only_its_range():
    """A picture with a bound for each pixel would make the sheet larger than the policy."""
    low = np.arange(MOST_BOUNDS + 1, dtype=np.float32)
    large, small = spaces.Box(low, low + 5.0), spaces.Box(low[:2], np.array([np.inf, 3.0], np.float32))

    assert (describe(large)["low"], describe(large)["high"]) == ([0.0, 1000.0], [5.0, 1005.0])
    assert (describe(small)["low"], describe(small)["high"]) == ([0.0, 1.0], ["inf", 3.0])
