"""The trials of a Sweep follow from the file alone, by a pure function."""

import math
from itertools import product

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.errors import SpecErrors
from palaestra.sweeps.grid import chance, drawn, probes, settings, short, trials
from palaestra.sweeps.model import LABEL, Distribution, Sweep, SweepName, SweepSpec
from tests.unit.sweeps.conftest import JOB

RATE = "trainer.algorithm.hyperparameters.learning_rate"
VALUES = st.lists(st.integers() | st.text(max_size=3), min_size=1, max_size=4)
SHARES = st.floats(0, 1, exclude_max=True)


def plain(**spec):
    """Return a sweep that was not read from a file."""
    return Sweep(metadata=SweepName(name="s"), spec=SweepSpec(job=JOB, **spec))


@given(st.dictionaries(st.sampled_from(["seed", "trainer.steps", "replicas"]), VALUES, min_size=1))
def test_a_matrix_is_every_combination_once_in_the_order_of_the_file(matrix) -> None:
    """A person compares trials by number, so the same number must always have the same values."""
    found = list(settings(plain(matrix={field: tuple(values) for field, values in matrix.items()})))

    assert [tuple(point.values()) for point in found] == list(product(*matrix.values()))
    assert all(list(point) == list(matrix) for point in found)


@given(st.integers(1, 10**9), st.integers(1, 10**9), SHARES, st.booleans())
def test_what_is_drawn_from_a_range_lies_in_it(low, more, share, log) -> None:
    """An integer stays an integer, and other numbers are not rounded."""
    whole = drawn(Distribution(low=low, high=low + more, log=log), share)
    real = drawn(Distribution(low=float(low), high=float(low + more), log=log), share)

    assert isinstance(whole, int)
    assert low <= whole <= low + more
    assert isinstance(real, float)
    assert low <= real <= low + more


@given(st.lists(st.integers(), min_size=1), SHARES)
def test_a_choice_is_one_of_its_values(choice, share) -> None:
    """Another value could be invalid for the job."""
    assert drawn(Distribution(choice=tuple(choice)), share) in choice


def test_chance_is_uniform_and_repeats() -> None:
    """A sweep has the same trials on every machine and in every release of Python."""
    drawn_numbers = [chance(1, number, "seed") for number in range(2000)]

    assert drawn_numbers[0] == chance(1, 0, "seed") == pytest.approx(0.568875, abs=1e-6)
    assert all(0 <= number < 1 for number in drawn_numbers)
    assert sum(drawn_numbers) / 2000 == pytest.approx(0.5, abs=0.02)


def test_more_trials_and_fields_change_no_earlier_value(sweep) -> None:
    """A person may extend a sweep after some trials have ended, and these must keep their values."""
    rate = {RATE: {"low": 1e-5, "high": 1e-2, "log": True}}
    few = list(settings(sweep(random=rate, trials=2)))
    more = list(settings(sweep(random={"seed": {"low": 1, "high": 9}, **rate}, trials=4)))

    assert [point[RATE] for point in more[:2]] == [point[RATE] for point in few]
    assert all(-5 <= math.log10(point[RATE]) <= -2 for point in more)


def test_a_trial_is_a_job_with_the_label_and_a_replica_for_each_seed(sweep) -> None:
    """A cluster can run the job unchanged, and `kubectl` lists the jobs of a sweep by the label."""
    first, second = trials(sweep(matrix={RATE: [1e-3, 1e-4]}, seeds=3))

    assert (first.name, second.name) == ("s-0", "s-1")
    assert second.job.spec.replicas == 3
    assert second.job.spec.trainer.algorithm.hyperparameters == {"learning_rate": 1e-4}
    assert second.job.metadata.labels == {LABEL: "s"}


def test_the_mistakes_of_all_trials_are_reported_at_once(sweep) -> None:
    """The error comes before the first trial starts, and names the first trial with each mistake."""
    with pytest.raises(SpecErrors) as refused:
        trials(sweep(matrix={"trainer.steps": [1, 0], "seed": [-1, 1]}))

    assert refused.value.problems == (
        "trial 0: spec.seed: -1 is less than 0; use 0 or more",
        "trial 2: spec.trainer.steps: 0 is less than 1; use 1 or more",
    )


def test_a_search_is_checked_at_its_bounds(sweep) -> None:
    """Without this check, Optuna could suggest an invalid value after hours."""
    found = sweep(
        random={"seed": {"low": -1, "high": 9}, "trainer.steps": {"choice": [1, 2, 3]}}, trials=9, optuna={}
    )

    assert list(probes(found)) == [
        {"seed": -1, "trainer.steps": 1},
        {"seed": 9, "trainer.steps": 2},
        {"seed": -1, "trainer.steps": 3},
    ]
    with pytest.raises(SpecErrors, match=r"spec\.seed: -1 is less than 0"):
        trials(found)


@pytest.mark.parametrize(
    ("fields", "shown"),
    [(["a.b", "a.c"], ["b", "c"]), (["a.b.c", "a.d.c"], ["b.c", "d.c"]), (["c", "a.c"], ["c", "a.c"])],
)
def test_a_heading_is_as_short_as_it_can_be(fields, shown) -> None:
    """A table whose headings were whole field paths would be too wide for a terminal."""
    assert list(short(fields).values()) == shown
