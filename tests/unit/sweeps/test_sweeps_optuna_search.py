"""A search with Optuna: it suggests trials, prunes them, and continues after an interruption."""

import pytest

from palaestra.sweeps.optuna_search import JOURNAL, OptunaSearch
from palaestra.sweeps.trial import TrialFigures, TrialProgress
from tests.unit.sweeps.conftest import JOB, figures

SPACE = {"seed": {"low": 1, "high": 99}, "trainer.steps": {"choice": [1000, 2000]}}


@pytest.fixture
def search(sweep, tmp_path):
    """Return a function that opens the same search again from its journal."""

    def make(trials=4, trainer=None, **optuna):
        job = {**JOB, "spec": {**JOB["spec"], "trainer": trainer or {}}}
        return OptunaSearch(
            sweep(job=job, random=SPACE, trials=trials, optuna={"startupTrials": 1, **optuna}), tmp_path
        )

    return make


def test_a_trial_below_the_median_is_pruned(search) -> None:
    """One fast seed must not decide, so medians are compared at a step that all seeds have reached."""
    found = search()
    found.learn(found.next(), figures({5: 0.8}, {5: 0.9}))  # this trial ended before its first report
    other = found.next()

    assert not found.hopeless(other, figures({5: 0.1}, {}, ended=False))
    assert found.hopeless(other, figures({5: 0.1}, {5: 0.2}, ended=False))
    assert found.hopeless(other, figures({5: 0.1}, {5: 0.2}, ended=False))
    found.learn(other, TrialFigures(state=TrialProgress.PRUNED))


def test_a_trial_is_pruned_whose_evaluations_are_at_other_steps(search) -> None:
    """Optuna compares equal steps only, and in a cluster no two trials are seen at equal steps."""
    found = search()
    found.learn(found.next(), figures({2500: 0.9, 7700: 0.9}))

    assert found.hopeless(found.next(), figures({5003: 0.1}, ended=False))


def test_trials_without_a_number_of_steps_between_evaluations_are_compared_at_their_own_steps(search) -> None:
    """A user's own program may report success rates, although the trainer makes no evaluations."""
    found = search(trainer={"evaluation": {"everySteps": 0}})
    found.learn(found.next(), figures({5003: 0.9}))

    assert not found.hopeless(found.next(), figures({5000: 0.1}, ended=False))
    assert found.hopeless(found.next(), figures({5003: 0.1}, ended=False))


def test_nothing_is_pruned_if_the_sweep_does_not_want_it(search) -> None:
    """With `prune: false` each trial runs to its end, so each curve is complete."""
    found = search(prune=False)
    found.learn(found.next(), figures({5: 0.9}))

    assert not found.hopeless(found.next(), figures({5: 0.1}, ended=False))


def test_an_interrupted_search_suggests_its_running_trial_again_under_its_number(search) -> None:
    """The run directory is found by the number of the trial.

    New trials follow until the wanted number is reached.
    """
    first = search()
    done, running = first.next(), first.next()
    first.learn(done, figures({5: 0.9}))

    again = search()
    resumed = again.next()
    assert resumed == running
    assert not again.hopeless(resumed, figures({5: 0.95}, ended=False))
    again.learn(resumed, figures({5: 0.95}))
    fresh = [again.next(), again.next()]

    assert [trial.number for trial in fresh] == [2, 3]
    assert again.next() is None
    assert len({tuple(trial.changes.values()) for trial in again.known}) == 4
    assert [trial.number for trial in again.known] == [0, 1, 2, 3]


def test_a_kill_at_any_moment_of_a_restart_loses_no_trial(search, tmp_path) -> None:
    """The test cuts the journal after each write of a restart, as a kill at that moment would."""
    first, journal = search(trials=2), tmp_path / JOURNAL
    done, running = first.next(), first.next()
    first.learn(done, figures({5: 0.9}))
    kept = len(journal.read_text().splitlines())
    search(trials=2).next()
    lines = journal.read_text().splitlines(keepends=True)

    for end in range(kept, len(lines) + 1):
        journal.write_text("".join(lines[:end]))
        again = search(trials=2)
        known = again.known
        assert again.next() == running, f"after {end - kept} of {len(lines) - kept} writes"
        assert known == again.known == [done, running]
        assert again.next() is None


def test_a_trial_that_fails_or_has_no_figure_has_no_value(search) -> None:
    """The search learns nothing from such a trial, and continues with the next one."""
    found = search(trials=3)
    found.learn(found.next(), figures({5: 1.0}, succeeded=False))
    found.learn(found.next(), figures({}))

    assert found.next() is not None
    assert found.next() is None
