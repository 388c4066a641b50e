"""The file of a run's faults: each fault is written at once, and its duration when it ends."""

from __future__ import annotations

import pytest

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.errors import SimulatorDead, WrongData
from palaestra_trainer.job.run_directory import read_lines
from palaestra_trainer.run.telemetry import fault_log
from palaestra_trainer.run.telemetry.fault_log import FaultLog
from palaestra_trainer.run.telemetry.progress import Progress


@pytest.fixture
def progress(tmp_path, clock):
    """Return the progress of a run with a file of faults."""
    progress = Progress(100, [("collect-0", Role.COLLECT), ("collect-1", Role.COLLECT)], clock)
    progress.fault_log = FaultLog(tmp_path / "faults.jsonl", 2, clock)
    return progress


def died(progress, simulator):
    """Report that a simulator died."""
    progress.fault(simulator, SimulatorDead(simulator, "died"), 7)


def test_a_fault_is_written_at_once_and_its_end_when_the_simulator_is_up(progress, tmp_path, clock):
    """A run may be killed before the restart has ended; its report still has the fault."""
    progress.step = 50
    died(progress, "collect-0")
    [line] = read_lines(tmp_path / "faults.jsonl")
    clock.now = 2.5
    died(progress, "collect-0")
    clock.now = 4.0
    progress.restarted("collect-0", recycled=False)

    assert {name: line[name] for name in ("simulator", "kind", "fact", "step", "attempt", "steps_lost")} == {
        "simulator": "collect-0",
        "kind": "dead",
        "fact": "collect-0: died",
        "step": 50,
        "attempt": 2,
        "steps_lost": 7,
    }
    assert [*read_lines(tmp_path / "faults.jsonl")][-1] == {
        "simulator": "collect-0",
        "attempt": 2,
        "up_after_s": [4.0, 1.5],
    }


def test_a_copy_that_fails_does_not_mark_its_simulator_as_down(progress, tmp_path, clock):
    """A simulator with copies goes on, so it is not down for the rest of the run."""
    progress.started("collect-0")
    progress.started("collect-1")
    fault = WrongData("collect-0", "row 3: its simulation diverged")
    progress.fault("collect-0", fault, 7, restarts=False)
    down = progress.down()
    clock.now = 60.0
    progress.restarted("collect-0", recycled=True)

    lines = [*read_lines(tmp_path / "faults.jsonl")]

    assert [line.get("fact") or line["up_after_s"] for line in lines] == [str(fault), [0.0]]
    assert progress.counters.faults[fault.kind] == 1
    assert down == []


def test_a_recycled_simulator_had_no_fault(progress, tmp_path):
    """The restart of a recycled simulator is planned, so it is not in the file of faults."""
    progress.restarted("collect-1", recycled=True)

    assert [*read_lines(tmp_path / "faults.jsonl")] == []


def test_the_file_is_bounded(progress, tmp_path, monkeypatch):
    """A simulator that fails each second for a week must not fill the volume."""
    monkeypatch.setattr(fault_log, "MOST_BYTES", 500)

    for _ in range(20):
        died(progress, "collect-0")

    assert 500 < (tmp_path / "faults.jsonl").stat().st_size < 800
    assert progress.counters.broken == 20


def test_a_file_that_cannot_be_written_ends_nothing(progress, tmp_path):
    """The next checkpoint reports a full disk; here only the simulator must be restarted."""
    (tmp_path / "faults.jsonl").mkdir()

    died(progress, "collect-0")
    progress.restarted("collect-0", recycled=False)

    assert progress.counters.restarts == 1
