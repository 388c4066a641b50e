"""The log lines with the progress of a run."""

from __future__ import annotations

from structlog.testing import capture_logs

from palaestra_protocol.pod.status import SimulatorStatus, TrainerStatus
from palaestra_trainer.run.telemetry.progress_log import ProgressLog

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


def test_a_line_has_the_figures_as_fields():
    """A log store selects lines by their fields."""
    with capture_logs() as lines:
        ProgressLog().write(STATUS)

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


def test_it_is_due_at_once_and_then_at_intervals():
    """The training loop asks at each step, but a line for each step would fill the log."""
    progress = ProgressLog(every_s=60.0)
    first = progress.due
    progress.write(STATUS)

    assert (first, progress.due) == (True, False)
