"""The loop of a sweep, on a place without processes."""

from collections import Counter

from palaestra.sweeps import ledger
from palaestra.sweeps.carrying_out import carry_out
from palaestra.sweeps.expanding import trials
from palaestra.sweeps.searching import InTurn
from palaestra.sweeps.trial import State
from tests.unit.sweeps.conftest import figures


class Stage:
    """A place where a trial ends after as many looks as it has steps; two at the same time."""

    def __init__(self, fails=()):
        self.begun, self.looks, self.most, self._active, self._fails = [], Counter(), 0, set(), fails

    def has_room(self):
        """Return whether fewer than two trials run."""
        return len(self._active) < 2

    def begin(self, trial):
        """Note that a trial was begun."""
        self.begun.append(trial.number)
        self._active.add(trial.number)
        self.most = max(self.most, len(self._active))

    def wait(self):
        """Return at once."""

    def look(self, trial):
        """Return figures, those of the end at the last look."""
        self.looks[trial.number] += 1
        ended = self.looks[trial.number] == trial.job.spec.trainer.steps
        if ended:
            self._active.discard(trial.number)
        failed = trial.number in self._fails
        return figures(
            {1: 0.5}, {1: 0.25}, ended=ended, succeeded=not failed, reason="Diverged: NaN" if failed else ""
        )

    def prune(self, trial):
        """Make room."""
        self._active.discard(trial.number)


def carried_out(sweep, folder, **options):
    """Run a sweep of three trials; return the place, the ledger and what was reported."""
    stage, reported = Stage(**options), []
    found = trials(sweep(matrix={"trainer.steps": [3, 1, 2]}))
    carry_out(InTurn(found, ledger.ended(folder)), stage, folder, reported.append)
    return stage, ledger.ended(folder), reported


def test_trials_run_in_order_as_many_as_there_is_room_for(sweep, tmp_path) -> None:
    """The second ends first, and the third takes its place."""
    stage, ended, reported = carried_out(sweep, tmp_path)

    assert (stage.begun, stage.most) == ([0, 1, 2], 2)
    assert {number: found.state for number, found in ended.items()} == dict.fromkeys(
        (0, 1, 2), State.COMPLETE
    )
    assert reported[0] == "s-0: trainer.steps = 3"
    assert reported.index("s-1: complete") < reported.index("s-2: trainer.steps = 2")


def test_a_trial_that_failed_says_why(sweep, tmp_path) -> None:
    """A reason of several seeds once: the person should not search the logs of every run."""
    _, _, reported = carried_out(sweep, tmp_path, fails={2})

    assert [line for line in reported if "failed" in line] == ["s-2: failed; Diverged: NaN"]


def test_a_second_time_only_trials_that_failed_are_begun(sweep, tmp_path) -> None:
    """Also if the last line was cut by a crash: that trial counts as not ended."""
    _, ended, _ = carried_out(sweep, tmp_path, fails={2})
    assert ended[2].state is State.FAILED

    stage, ended, _ = carried_out(sweep, tmp_path)

    assert stage.begun == [2]
    assert ended[2].state is State.COMPLETE
    with (tmp_path / ledger.TRIALS).open("a") as file:
        file.write('{"trial": 0, "sta')
    assert ledger.ended(tmp_path) == ended
