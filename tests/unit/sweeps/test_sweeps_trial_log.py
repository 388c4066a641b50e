"""The folder of a sweep belongs to exactly one sweep."""

import pytest

from palaestra.local.errors import RunRefused
from palaestra.sweeps import trial_log
from palaestra.sweeps.trial import TrialFigures, TrialProgress

RANDOM = {"random": {"seed": {"low": 1, "high": 9}}}


def test_more_trials_are_the_same_sweep_and_other_values_are_not(sweep, tmp_path) -> None:
    """A table that mixes the results of two sweeps would mislead its reader."""
    folder = tmp_path / "s"
    trial_log.begin(folder, sweep(**RANDOM, trials=3))
    trial_log.begin(folder, sweep(**RANDOM, trials=5))

    with pytest.raises(
        RunRefused, match=r"spec\.random, spec\.seed: differs from the sweep whose runs are in .*; undo"
    ):
        trial_log.begin(folder, sweep(random={"seed": {"low": 2, "high": 9}}, seed=2, trials=5))


def test_another_objective_compares_the_same_trials_unless_optuna_has_learned_from_the_first(
    sweep, tmp_path
) -> None:
    """A person who corrects the objective in the file must not train all trials again."""
    trial_log.begin(tmp_path / "s", sweep(**RANDOM, trials=3))
    trial_log.begin(tmp_path / "s", sweep(**RANDOM, trials=3, objective="MeanReturn"))
    trial_log.begin(tmp_path / "o", sweep(**RANDOM, trials=3, optuna={}))

    with pytest.raises(RunRefused, match=r"spec\.objective: differs from the sweep whose"):
        trial_log.begin(tmp_path / "o", sweep(**RANDOM, trials=3, optuna={}, objective="MeanReturn"))


def test_a_line_that_a_crash_has_cut_spoils_no_later_one(sweep, tmp_path) -> None:
    """The next entry must not be appended to the truncated one, or the sweep could not continue."""
    folder = tmp_path / "s"
    trial_log.begin(folder, sweep(**RANDOM, trials=3))
    trial_log.note(folder, 0, TrialFigures(state=TrialProgress.COMPLETE))
    with (folder / trial_log.TRIALS).open("a") as file:
        file.write('{"trial": 1, "sta')

    trial_log.begin(folder, sweep(**RANDOM, trials=3))
    trial_log.note(folder, 1, TrialFigures(state=TrialProgress.FAILED))

    assert {number: found.state for number, found in trial_log.ended(folder).items()} == {
        0: TrialProgress.COMPLETE,
        1: TrialProgress.FAILED,
    }
