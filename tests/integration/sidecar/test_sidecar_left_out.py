"""Nodes of a world that a simulator leaves out: the sidecar shows the simulator's report in /state."""

import pytest

from palaestra_protocol.control import SidecarState

REPORTS = """
import os, pathlib, signal
file = pathlib.Path(os.environ["PALAESTRA_SIMULATOR_LEFT_OUT"])
print("there already" if file.exists() else "new")
if os.environ["PALAESTRA_SIMULATOR_START"] == "1":
    file.write_text(f"no Drone: 1 node left out (line 7)\\n{file.name}\\n")
print("up")
signal.pause()
"""
UNASKED = """
import os, signal
print(os.environ.get("PALAESTRA_SIMULATOR_LEFT_OUT"))
print("up")
signal.pause()
"""


@pytest.fixture
def named(tmp_path):
    """Return options that give the simulators the names of a job, and a work folder."""
    return ("--job=j", f"--work={tmp_path / 'work'}")


def test_the_state_has_what_the_simulator_left_out_once_it_is_ready(sidecar, named) -> None:
    """The report may be missing before the simulator is ready, and may differ in the next start."""
    it = sidecar(REPORTS, *named)
    assert it.start().left_out == ()

    told = ("no Drone: 1 node left out (line 7)", "collect-0.left-out")
    assert it.request("/ready").left_out == told
    assert it.request("/stop", {"deadline_s": 0}).left_out == told

    it.until(SidecarState.IDLE)
    it.start()
    assert it.request("/ready").left_out == ()
    assert it.lines.count("new") == 2


def test_a_standby_reports_for_itself(sidecar, named) -> None:
    """Both simulators may start at the same time, so their reports need different files."""
    it = sidecar(REPORTS, *named, "--standby")
    it.request("/standby/start")
    it.until_said("b: up")

    assert it.request("/standby/ready").left_out[1] == "collect-0b.left-out"


def test_a_simulator_without_a_work_folder_is_not_asked(sidecar) -> None:
    """Only the work folder is certainly writable, so without it no report is requested."""
    it = sidecar(UNASKED)
    it.start()

    assert it.request("/ready").left_out == ()
    assert "None" in it.lines
