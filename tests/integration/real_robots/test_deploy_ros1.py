"""`palaestra-deploy` with the address of a ROS master."""

import subprocess
import sys

import pytest

from tests.mock_robots import DEADLINE_S, ended, started
from tests.packages import write_package

PROGRAM = (sys.executable, "-m", "palaestra_trainer.cli.deploy")
SPEED = 2.0


@pytest.fixture
def mock(master):
    """Yield the client of a robot whose driver has its default limits."""
    del master
    process, client = started("--ros1", "--drift=0", "--start=0,0,0", f"--speed={SPEED:g}")
    yield client
    ended(process, client)


@pytest.fixture
def deploy(master, tmp_path):
    """Return a function that runs the program to its end; its arguments follow package and robot."""
    package = write_package(tmp_path / "package")
    options = [f"--mock-speed={SPEED:g}", f"--log={tmp_path / 'log.mcap'}", "--target=1,0"]

    def run(*arguments):
        robot = f"--robot={master.replace('http:', 'ros1:')}"
        command = [*PROGRAM, package, robot, *options, *arguments]
        return subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)

    return run


def test_a_dry_run_over_ros_reads_and_sends_no_command(deploy, mock):
    """To use ROS instead of REST, a person changes only the robot's address; a dry run must stay safe."""
    done = deploy("--dry-run")

    assert done.returncode == 0, done.stderr
    assert done.stdout.count("dry run: forward +0.") == 10
    assert mock.get("/mock/truth")["commands"] == 0


@pytest.mark.usefixtures("mock")
def test_a_limit_of_the_driver_is_reported_before_the_robot_moves(deploy):
    """Exit code 2 means that the robot has not moved."""
    done = deploy("--yes", "--no-hold", "--speed-limit=0.5")

    assert done.returncode == 2
    assert "/robotino_node/max_linear_vel is 0.2 m/s, below 0.5 m/s; set the parameter and" in done.stderr
