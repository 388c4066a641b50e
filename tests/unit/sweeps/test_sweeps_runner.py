"""The loop of a sweep, with a backend that starts no processes."""

from collections import Counter
from dataclasses import replace

import pytest

from palaestra.sweeps import trial_log
from palaestra.sweeps.grid import trials
from palaestra.sweeps.model import Objective
from palaestra.sweeps.runner import NoSuccess, carry_out
from palaestra.sweeps.search import InTurn
from palaestra.sweeps.trial import TrialProgress
from tests.unit.sweeps.conftest import figures


class Stage:
    """A backend for two trials at a time; each trial ends after as many reports as it has steps."""

    def __init__(self, fails=(), *, success=True):
        self.begun, self.looks, self.most, self._active, self._fails = [], Counter(), 0, set(), fails
        self._success = success

    def has_room(self):
        """Return whether fewer than two trials run."""
        return len(self._active) < 2

    def begin(self, trial):
        """Record the start of a trial."""
        self.begun.append(trial.number)
        self._active.add(trial.number)
        self.most = max(self.most, len(self._active))

    def wait(self):
        """Return at once, because no process needs time."""

    def look(self, trial):
        """Return the results of a trial, which ends with its last report."""
        self.looks[trial.number] += 1
        ended = self.looks[trial.number] == trial.job.spec.trainer.steps
        if ended:
            self._active.discard(trial.number)
        failed = trial.number in self._fails
        found = figures(
            {1: 0.5}, {1: 0.25}, ended=ended, succeeded=not failed, reason="Diverged: NaN" if failed else ""
        )
        return found if self._success else without_success(found)

    def prune(self, trial):
        """End a trial early."""
        self._active.discard(trial.number)


def without_success(found):
    """Return results of the same runs, for an environment that reports no success."""
    runs = [replace(run, curve=(replace(run.curve[0], success_rate=None),)) for run in found.runs]
    return replace(found, runs=tuple(runs))


def carried_out(sweep, folder, objective=Objective.SUCCESS_RATE, **options):
    """Run a sweep of three trials; return the backend, the ended trials and the printed lines."""
    stage, reported = Stage(**options), []
    found = trials(sweep(matrix={"trainer.steps": [3, 1, 2]}))
    carry_out(InTurn(found, trial_log.ended(folder)), stage, folder, objective, reported.append)
    return stage, trial_log.ended(folder), reported


def test_trials_run_in_order_as_many_as_there_is_room_for(sweep, tmp_path) -> None:
    """The second trial ends first, and the third trial starts in its place."""
    stage, ended, reported = carried_out(sweep, tmp_path)

    assert (stage.begun, stage.most) == ([0, 1, 2], 2)
    assert {number: found.state for number, found in ended.items()} == dict.fromkeys(
        (0, 1, 2), TrialProgress.COMPLETE
    )
    assert reported[0] == "s-0: trainer.steps = 3"
    assert reported[2:] == [
        "s-1: complete; success rate 0.375; 2 trials left",
        "s-2: trainer.steps = 2",
        "s-0: complete; success rate 0.375; 1 trial left",
        "s-2: complete; success rate 0.375; 0 trials left",
    ]


def test_a_trial_that_failed_says_why(sweep, tmp_path) -> None:
    """Several seeds with the same reason show it once, so a person need not search the log of each run."""
    _, _, reported = carried_out(sweep, tmp_path, fails={2})

    assert [line for line in reported if "failed" in line] == [
        "s-2: failed; Diverged: NaN; success rate 0.375; 0 trials left"
    ]


def test_a_sweep_of_success_where_there_is_none_ends_with_the_objective_to_write(sweep, tmp_path) -> None:
    """Without the error, every trial would train for hours, and the table would then be empty."""
    with pytest.raises(
        NoSuccess, match=r"spec\.objective: .* write objective: MeanReturn, or set is_success"
    ):
        carried_out(sweep, tmp_path, success=False)

    _, _, reported = carried_out(sweep, tmp_path, Objective.MEAN_RETURN, success=False)

    assert "s-1: complete; mean return -0.375; 2 trials left" in reported


def test_a_sweep_of_success_that_has_ended_without_any_is_refused_too(sweep, tmp_path) -> None:
    """Without the error, a repeated command would print an empty table as if all were well."""
    carried_out(sweep, tmp_path, Objective.MEAN_RETURN, success=False)

    with pytest.raises(NoSuccess):
        carried_out(sweep, tmp_path)


def test_a_second_time_only_trials_that_failed_are_begun(sweep, tmp_path) -> None:
    """A trial whose last line was truncated by a crash counts as not ended."""
    _, ended, _ = carried_out(sweep, tmp_path, fails={2})
    assert ended[2].state is TrialProgress.FAILED

    stage, ended, _ = carried_out(sweep, tmp_path)

    assert stage.begun == [2]
    assert ended[2].state is TrialProgress.COMPLETE
    with (tmp_path / trial_log.TRIALS).open("a") as file:
        file.write('{"trial": 0, "sta')
    assert trial_log.ended(tmp_path) == ended
