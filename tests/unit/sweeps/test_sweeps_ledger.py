"""The folder of a sweep belongs to one sweep."""

import pytest

from palaestra.local.errors import Refused
from palaestra.sweeps import ledger
from palaestra.sweeps.trial import Figures, State

RANDOM = {"random": {"seed": {"low": 1, "high": 9}}}


def test_more_trials_are_the_same_sweep_and_other_values_are_not(sweep, tmp_path) -> None:
    """Results of two sweeps in one table would be of none."""
    folder = tmp_path / "s"
    ledger.begin(folder, sweep(**RANDOM, trials=3))
    ledger.begin(folder, sweep(**RANDOM, trials=5))

    with pytest.raises(
        Refused, match=r"spec\.random, spec\.seed: not as when the sweep in .* was begun; change"
    ):
        ledger.begin(folder, sweep(random={"seed": {"low": 2, "high": 9}}, seed=2, trials=5))


def test_another_objective_compares_the_same_trials_unless_optuna_has_learned_from_the_first(
    sweep, tmp_path
) -> None:
    """A file that is corrected must not train every trial once more."""
    ledger.begin(tmp_path / "s", sweep(**RANDOM, trials=3))
    ledger.begin(tmp_path / "s", sweep(**RANDOM, trials=3, objective="MeanReturn"))
    ledger.begin(tmp_path / "o", sweep(**RANDOM, trials=3, optuna={}))

    with pytest.raises(Refused, match=r"spec\.objective: not as when the sweep"):
        ledger.begin(tmp_path / "o", sweep(**RANDOM, trials=3, optuna={}, objective="MeanReturn"))


def test_a_line_that_a_crash_has_cut_spoils_no_later_one(sweep, tmp_path) -> None:
    """Later lines would be appended to it, and the sweep could never be continued."""
    folder = tmp_path / "s"
    ledger.begin(folder, sweep(**RANDOM, trials=3))
    ledger.note(folder, 0, Figures(state=State.COMPLETE))
    with (folder / ledger.TRIALS).open("a") as file:
        file.write('{"trial": 1, "sta')

    ledger.begin(folder, sweep(**RANDOM, trials=3))
    ledger.note(folder, 1, Figures(state=State.FAILED))

    assert {number: found.state for number, found in ledger.ended(folder).items()} == {
        0: State.COMPLETE,
        1: State.FAILED,
    }
