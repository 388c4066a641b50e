"""The progress lines that `palaestra run` prints during the training."""

import asyncio

import pytest

from palaestra.local.progress import RunProgress
from palaestra.local.progress_line import progress_line, show_progress
from palaestra_protocol.pod.status import SuccessInterval


def progress(**values):
    """Return the progress of a run that has been evaluated."""
    usual = {
        "phase": "training",
        "step": 12_500,
        "target": 50_000,
        "steps_per_second": 122.4,
        "success_rate": 0.96,
        "success_interval": SuccessInterval(low=0.866, high=0.989, episodes=50),
        "faults": 0,
    }
    return RunProgress(**{**usual, **values})


def test_a_line_says_how_far_how_good_how_fast_and_how_long():
    """A person can read the line without documentation."""
    line = progress_line(progress())

    assert line == (
        "step 12,500 of 50,000 · 96 % (87 to 99) of 50 episodes · 122 steps/s · 0 faults · 5 min left"
    )


@pytest.mark.parametrize(
    ("values", "text"),
    [
        ({"faults": 1}, "1 fault · 5 min left"),
        ({"phase": "evaluating"}, "5 min left · evaluating"),
        ({"success_interval": None}, "· 96 % · 122"),
        ({"success_rate": None, "success_interval": None}, "50,000 · 122"),
        ({"steps_per_second": None}, "50 episodes · 0 faults"),
        ({"step": 50_000}, "122 steps/s · 0 faults"),
        ({"step": 49_000}, "8 s left"),
        ({"target": 2_000_000}, "4 h 31 min left"),
    ],
)
def test_unknown_values_are_left_out_and_times_are_rounded(values, text):
    """A zero instead of an unknown value would mislead the reader."""
    assert text in progress_line(progress(**values))


def test_lines_are_shown_while_the_trainer_responds():
    """During its start a run has no target, and between two attempts its last speed is old."""
    before, later = progress(), progress(step=13_000)

    class Reader:
        def __init__(self):
            self.values = [RunProgress(), before, before, before, later, later]

        def progress(self):
            return self.values.pop(0)

    lines = []

    async def shown():
        with pytest.raises(IndexError):  # the reader has no more values
            await show_progress(Reader(), lines.append, every_s=0.0, first_s=0.0)

    asyncio.run(shown())

    assert [line.split(" of ")[0] for line in lines] == ["step 12,500", "step 13,000"]
