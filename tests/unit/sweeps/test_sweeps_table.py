"""The result of a sweep has medians and quartiles over seeds, as a table and as a chart."""

from palaestra.sweeps.model import Objective
from palaestra.sweeps.plot import draw
from palaestra.sweeps.table import TrialRow, lines
from palaestra.sweeps.trial import TrialFigures, TrialProgress
from tests.unit.sweeps.conftest import figures

RATE = Objective.SUCCESS_RATE
ROWS = [
    TrialRow(
        name="s-0",
        changes={"trainer.a": 1e-4, "b": "x"},
        figures=figures({5: 0.2, 10: 0.4}, {5: 0.0, 10: 0.8}),
    ),
    TrialRow(
        name="s-1", changes={"trainer.a": 1e-3, "b": "x"}, figures=figures({5: 0.9}, {5: 0.7}, {5: 0.8})
    ),
    TrialRow(name="s-2", changes={"trainer.a": 1e-2, "b": "x"}, figures=figures({5: 1.0}, succeeded=False)),
    TrialRow(
        name="s-3", changes={"trainer.a": 0.1, "b": "x"}, figures=TrialFigures(state=TrialProgress.WAITING)
    ),
]


def test_the_table_has_median_and_quartiles_and_the_best_complete_trial() -> None:
    """A failed trial is never the best trial, whatever its success rate was."""
    assert list(lines(ROWS, RATE)) == [
        "trial  a       b  state     seeds  success rate  quartiles",
        "s-0    0.0001  x  complete  2/2    0.6           0.5 to 0.7",
        "s-1    0.001   x  complete  3/3    0.8           0.75 to 0.85",
        "s-2    0.01    x  failed    0/1    1             1 to 1",
        "s-3    0.1     x  waiting   -      -             -",
        "",
        "best: s-1, trainer.a = 0.001, b = x",
    ]


def test_a_curve_goes_as_far_as_all_of_its_seeds() -> None:
    """Beyond that, a median over the fastest seeds would compare seeds instead of settings."""
    found = figures({5: 0.2, 10: 0.4, 15: 1.0}, {4: 0.1, 10: 0.8}, ended=False)

    assert found.common(RATE) == {5: 0.15000000000000002, 10: 0.6000000000000001}
    assert found.state is TrialProgress.RUNNING
    assert found.common(Objective.MEAN_RETURN)[10] == -0.6000000000000001


def test_curves_are_drawn_where_there_are_some(tmp_path) -> None:
    """A sweep that was interrupted at once has no curves to plot."""
    assert draw(ROWS, RATE, tmp_path / "curves.png")
    assert not draw(ROWS[3:], RATE, tmp_path / "none.png")

    assert (tmp_path / "curves.png").read_bytes().startswith(b"\x89PNG")
    assert not (tmp_path / "none.png").exists()
