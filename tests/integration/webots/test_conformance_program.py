"""`palaestra-conformance` over a running simulator, as a person types it."""

import os
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import pytest

from palaestra_trainer.ros import is_served
from tests.waiting import eventually

PROGRAM = Path(sys.executable).with_name("palaestra-conformance")
STUB = Path(sys.executable).with_name("palaestra-stub")
OWN = Path(__file__).parents[3] / "examples/simulators/cart_simulator.py"
DEADLINE_S = 120.0


def conformance(folder, *options, **environment):
    """Run the program in a folder, and return the completed process."""
    return subprocess.run(
        [PROGRAM, *options],
        cwd=folder,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )


@contextmanager
def running(world, *program):
    """Run a simulator until the end of the block, and wait for its last service."""
    with subprocess.Popen([*(program or [STUB]), world], stderr=subprocess.DEVNULL) as process:
        try:
            eventually(lambda: is_served(f"/{world.stem}/robot/get_device_list"), DEADLINE_S)
            yield process
        finally:
            process.terminate()  # after SIGTERM, the simulator unregisters its services
            process.wait(DEADLINE_S)


def test_a_stub_keeps_every_claim_of_its_column_and_not_those_of_webots(master, tmp_path):
    """A person reads which claims do not hold, and finds the same in the report."""
    written = conformance(tmp_path, "--world")
    with running(tmp_path / "everything.wbt"):
        for_webots = conformance(tmp_path, "--master", master, "--report", "webots.md")
    with running(tmp_path / "everything.wbt") as process:  # again, because the calls changed the world
        own = conformance(tmp_path, "--master", master, "--claims", "stub", "--all", "--report", "stub.md")
        process.wait(DEADLINE_S)

    assert (written.returncode, written.stdout) == (0, "everything.wbt\n")
    assert for_webots.returncode == 1
    assert "\ncamera/enable: " in f"\n{for_webots.stdout}"
    assert "camera/image: no message arrived" in for_webots.stdout
    assert (own.returncode, own.stderr) == (0, "")
    assert own.stdout == "433 of 433 claims hold\n"
    assert (
        "| `camera/image` | sensor_msgs/Image | no message arrived |" in (tmp_path / "webots.md").read_text()
    )
    assert "| `gps/values` | geometry_msgs/PointStamped | holds |" in (tmp_path / "stub.md").read_text()


@pytest.mark.parametrize("program", [(), (sys.executable, OWN)], ids=["stub", "example"])
def test_a_simulator_that_serves_what_a_training_needs_keeps_these_claims(master, tmp_path, program):
    """The author of another simulator learns from these claims whether a job can train in it."""
    training = ("--claims", "training")
    written = conformance(tmp_path, "--world", *training)
    with running(tmp_path / "cart.wbt", *program) as process:
        tested = conformance(tmp_path, "--master", master, "--all", "--report", "report.md", *training)
        code = process.wait(DEADLINE_S)

    assert (written.returncode, written.stdout) == (0, "cart.wbt\n")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cart.wbt", "report.md"]
    assert (tested.returncode, tested.stdout, tested.stderr) == (0, "31 of 31 claims hold\n", "")
    assert "| `a step lasts its period` |  | holds |" in (tmp_path / "report.md").read_text()
    assert code == 0


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        (("--name", "absent"), "the robot absent has no services"),
        (("--claims", "training"), "the robot cart has no services"),
        (("--master", "http://127.0.0.1:9"), "127.0.0.1:9"),
        (("--claims", "gazebo"), "invalid choice: 'gazebo'"),
        (("--world", "--files", "/dev/null"), "use a folder in which you can write"),
    ],
)
def test_a_mistake_ends_the_program_with_one_sentence(master, tmp_path, options, problem):
    """The program makes no call, so it reports no claim as wrong."""
    ended = conformance(tmp_path, *options, ROS_MASTER_URI=master)

    assert ended.returncode == 2
    assert problem in ended.stderr
    assert "Traceback" not in ended.stderr
    assert ended.stdout == ""
