"""The parts of a world that a simulator leaves out, from its report to the sidecar's /state."""

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
    """Return the options for the names of a job, with a work folder."""
    return ("--job=j", f"--work={tmp_path / 'work'}")


def test_the_state_has_what_the_simulator_left_out_once_it_is_ready(sidecar, named) -> None:
    """Before that the report may not exist yet. The next start may have another report, or none."""
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
    """The two may start at the same time."""
    it = sidecar(REPORTS, *named, "--standby")
    it.request("/standby/start")
    it.until_said("b: up")

    assert it.request("/standby/ready").left_out[1] == "collect-0b.left-out"


def test_a_simulator_without_a_work_folder_is_not_asked(sidecar) -> None:
    """Without the folder there is no place where a file can certainly be written."""
    it = sidecar(UNASKED)
    it.start()

    assert it.request("/ready").left_out == ()
    assert "None" in it.lines
