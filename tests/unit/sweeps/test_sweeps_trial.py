"""The figures of a trial's runs at steps at which trials can be compared."""

import pytest

from palaestra.sweeps.model import Objective
from tests.unit.sweeps.conftest import figures

SUCCESS = Objective.SUCCESS_RATE


def test_an_evaluation_counts_for_the_multiple_that_its_rollout_has_passed() -> None:
    """A run evaluates between two rollouts, so its steps depend on its hyperparameters."""
    found = figures({1024: 0.1, 2048: 0.2, 3072: 0.3})

    assert found.on_grid(1000, SUCCESS) == {1000: 0.1, 2000: 0.2, 3000: 0.3}


def test_a_multiple_without_an_evaluation_has_the_newest_figure_before_it() -> None:
    """In a cluster, the status is read at intervals, and only its newest evaluation is seen."""
    found = figures({2000: 0.2, 5000: 0.5})

    assert found.on_grid(1000, SUCCESS) == {2000: 0.2, 3000: 0.2, 4000: 0.2, 5000: 0.5}


def test_a_multiple_that_some_seed_has_not_reached_has_no_figure() -> None:
    """The median would otherwise be that of the fast seeds."""
    found = figures({1000: 0.1, 2000: 0.3}, {1000: 0.2}, ended=False)

    assert found.on_grid(1000, SUCCESS) == {1000: pytest.approx(0.15)}
    assert figures({1000: 0.1}, {}, ended=False).on_grid(1000, SUCCESS) == {}


def test_an_evaluation_before_the_first_multiple_counts_for_step_zero() -> None:
    """A trial may evaluate more often than the grid, and its first figure must not be lost."""
    assert figures({400: 0.1}).on_grid(1000, SUCCESS) == {0: 0.1}
