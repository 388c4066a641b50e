"""The display of a run's progress."""

from __future__ import annotations

import io

import pytest
from structlog.testing import capture_logs

from palaestra_protocol.pod.status import SimulatorStatus, TrainerStatus
from palaestra_trainer.telemetry.display import Bar, Lines, for_stream

STATUS = TrainerStatus(
    step=50,
    target=100,
    episodes=7,
    phase="training",
    mean_return=1.234,
    success_rate=0.85,
    steps_per_second=512.3,
    simulators=(SimulatorStatus(name="collect-0", role="Collect", state="ready", restarts=2),),
)


class Terminal(io.StringIO):
    """A stream that claims to be a terminal."""

    def isatty(self):
        """Return True."""
        return True


def test_a_terminal_gets_a_bar_with_the_figures():
    """These are steps, success, return, speed and faults."""
    terminal = Terminal()
    with for_stream(terminal) as display:
        display.show(STATUS)

    text = terminal.getvalue()
    assert "50/100" in text
    for figure in ("success 85%", "return 1.23", "steps/s 512", "faults 2"):
        assert figure in text


def test_anything_else_gets_lines():
    """A log file has no cursor."""
    with capture_logs() as lines, for_stream(io.StringIO()) as display:
        display.show(STATUS)

    assert lines == [
        {
            "event": "progress",
            "log_level": "info",
            "step": 50,
            "target": 100,
            "success_rate": 0.85,
            "mean_return": 1.23,
            "steps_per_second": 512.3,
            "faults": 2,
        }
    ]


@pytest.mark.parametrize("display", [Lines(every_s=60.0), Bar(Terminal())], ids=["lines", "bar"])
def test_it_is_shown_at_once_and_then_now_and_then(display):
    """Every step checks whether it is due, and most of them must get False."""
    first = display.due
    display.show(STATUS)

    assert (first, display.due) == (True, False)


def test_what_is_unknown_is_not_shown():
    """A return of None has no meaning for a reader."""
    terminal = Terminal()
    with Bar(terminal) as display:
        display.show(TrainerStatus(step=0, target=100, episodes=0, phase="starting"))

    assert "None" not in terminal.getvalue()
