"""`palaestra-deploy` drives a mock robot with a policy package, as a person would drive a real one."""

import json
import math
import os
import pty
import signal
import subprocess
import sys
import time

import numpy as np
import pytest

from palaestra_trainer.bags.reader import read_bag
from tests.mock_robots import ARRIVED_M, DEADLINE_S, SPEED
from tests.packages import changed_manifest, write_package, write_seeing_package
from tests.waiting import eventually

HANDS_OFF = ("--yes", "--no-hold", "--speed-limit=0.5")
# Imports of these fail, as on a robot's computer that has only the extra `deploy`.
LEAN = """
import sys
ABSENT = {"rospy", "sb3_contrib", "stable_baselines3", "tensorboard", "torch"}
class Absent:
    def find_spec(self, name, path=None, target=None):
        if name.partition(".")[0] in ABSENT:
            raise ModuleNotFoundError(name)
sys.meta_path.insert(0, Absent())
from palaestra_trainer.cli.deploy import deploy
sys.exit(deploy(sys.argv[1:]))
"""


@pytest.fixture
def package(tmp_path):
    """Return a package whose policy drives to the target."""
    return write_package(tmp_path / "package")


@pytest.fixture
def deploy(mock, package, tmp_path):
    """Return a function that runs the program to its end; its arguments follow package and robot."""

    def run(*arguments, package=package, **options):
        command = [sys.executable, "-c", LEAN, package, f"--robot=http://{mock.address}"]
        command += [f"--mock-speed={SPEED:g}", f"--log={tmp_path / 'log.mcap'}", *arguments]
        return subprocess.run(
            command, check=False, capture_output=True, text=True, timeout=DEADLINE_S, **options
        )

    return run


def decisions(log):
    """Return the records of a bag about decisions, as data."""
    return [json.loads(each.content["data"]) for each in read_bag(log).topics["/palaestra/decisions"]]


def test_the_robot_drives_from_target_to_target(deploy, mock, tmp_path):
    """Each further episode must begin where the last one ended, and odometry must agree with the true pose.

    The package is a zip, as a person sends it to the robot's computer.
    """
    sent = write_package(tmp_path / "package.zip")
    done = deploy("--target=1.2,0.3", "--target", "-0.5,0.2", *HANDS_OFF, package=sent)

    assert done.returncode == 0, done.stderr
    assert done.stdout.count("dry run: forward +0.") == 10
    assert done.stdout.count("reached after") == 2
    truth = mock.get("/mock/truth")
    assert (truth["x"], truth["y"]) == pytest.approx((-0.5, 0.2), abs=0.2)
    assert truth["vx"] == 0.0
    ends = [each for each in decisions(tmp_path / "log.mcap") if "episode" in each]
    assert [each["success"] for each in ends] == [True, True]


def test_the_record_has_poses_commands_and_readings(deploy, tmp_path):
    """With tools for ROS 2, a person who did not see the drive must be able to reconstruct it."""
    assert deploy("--target=0.6,0", *HANDS_OFF).returncode == 0
    topics = read_bag(tmp_path / "log.mcap").topics

    assert sorted(topics) == [
        "/bumper",
        "/distance_sensors",
        "/odom",
        "/palaestra/action",
        "/palaestra/cmd_vel",
        "/palaestra/decisions",
        "/palaestra/observation",
        "/target",
        "/tf",
    ]
    ways = [each.content["pose"]["pose"]["position"]["x"] for each in topics["/odom"]]
    assert ways[0] == pytest.approx(0.0, abs=0.01)
    assert ways[-1] == pytest.approx(0.5, abs=0.15)


def test_a_policy_that_sees_only_a_camera_drives_to_what_it_sees(mock, tmp_path):
    """The robot's picture is reduced to the image size of the training. The log contains the small image."""
    mock.send("/mock/place", [-1.3, 0.3, 0.2])
    package, log = write_seeing_package(tmp_path / "package"), tmp_path / "log.mcap"
    command = [sys.executable, "-m", "palaestra_trainer.cli.deploy", package, f"--mock-speed={SPEED:g}"]
    command += [f"--robot=http://{mock.address}", f"--log={log}", "--start=-1.3,0.3,0.2", "--target=0,0"]
    done = subprocess.run(
        [*command, *HANDS_OFF], check=False, capture_output=True, text=True, timeout=DEADLINE_S
    )

    assert done.returncode == 0, done.stderr
    assert "reached after" in done.stdout
    truth = mock.get("/mock/truth")
    assert math.hypot(truth["x"], truth["y"]) < ARRIVED_M
    first, *_, last = (each.content for each in read_bag(log).topics["/camera/image"])
    assert (first["height"], first["width"], first["encoding"]) == (48, 64, "rgb8")
    assert redness(last) > 3.0 * redness(first)


def redness(image):
    """Return the mean of red minus green of a recorded image."""
    pixels = np.frombuffer(bytes(image["data"]), np.uint8).reshape(48, 64, 3).astype(float)
    return (pixels[:, :, 0] - pixels[:, :, 1]).mean()


def test_a_dry_run_moves_nothing(deploy, mock):
    """A careful person begins with a dry run, so a dry run must be safe."""
    before = mock.get("/mock/truth")["commands"]
    done = deploy("--target=1,0", "--dry-run", "--no-hold")

    assert done.returncode == 0, done.stderr
    assert mock.get("/mock/truth")["commands"] == before


def test_without_a_yes_nothing_moves(deploy, mock):
    """The program must take any answer other than yes as a no."""
    before = mock.get("/mock/truth")["commands"]
    done = deploy("--target=1,0", "--no-hold", input="no\n")

    assert done.returncode == 3
    assert "emergency stop must be in reach. Type yes:" in done.stdout
    assert mock.get("/mock/truth")["commands"] == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--target=1,0", "--yes"), "standard input is not a terminal"),
        (HANDS_OFF, "neither --target nor --fence is given"),
        (("--target=one", *HANDS_OFF), "argument --target: 'one' is not X,Y in meters and radians"),
        (("--target=1,0", "--fence=0,0,0.1,1", *HANDS_OFF), "has no place for a robot of 0.46 m"),
        (
            ("--target=0.9,0", "--fence=-1,-1,1,1", *HANDS_OFF),
            "the target (0.9, 0) is too close to the fence",
        ),
        (("--target=0,0", "--start=0,2,0", "--fence=-1,-1,1,1", *HANDS_OFF), "the start (0, 2) is too close"),
    ],
)
def test_a_wrong_option_is_refused_before_the_robot_moves(deploy, mock, arguments, message):
    """Each message names the option and the remedy."""
    before = mock.get("/mock/truth")["commands"]
    done = deploy(*arguments, stdin=subprocess.DEVNULL)

    assert done.returncode == 2
    assert message in done.stderr
    assert mock.get("/mock/truth")["commands"] == before


def test_a_robot_at_its_charger_is_refused_and_leaves_no_record(deploy, mock, tmp_path):
    """Nothing happened, so there is nothing to record."""
    mock.send("/mock/charger", {"connected": True})
    done = deploy("--target=1,0", *HANDS_OFF)

    assert done.returncode == 2
    assert "is connected to its charger; unplug the charger" in done.stderr
    assert not list(tmp_path.glob("log.mcap*"))


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"robot": {"class": "TurtleBot3Burger", "period_s": 0.192}}, "the policy drives a TurtleBot3Burger"),
        ({"robot": {"class": "Robotino", "period_s": 9.0}}, "the policy acts every 9 s"),
        ({"robot": None}, "robot: None names no class and period_s"),
        ({"files": []}, "does not list policy.onnx"),
        ({"policy": {}}, "its observations differ from those that the policy learned with"),
    ],
)
def test_a_package_that_cannot_drive_the_robot_is_refused(deploy, package, fields, message):
    """A policy with another rate or for another robot would move it in a wrong way."""
    changed_manifest(package, **fields)
    done = deploy("--target=1,0", *HANDS_OFF)

    assert done.returncode == 2
    assert message in done.stderr


def test_ctrl_c_at_the_question_ends_the_program(mock, package, tmp_path):
    """A person who has changed their mind must not have to answer."""
    before = mock.get("/mock/truth")["commands"]
    command = [sys.executable, "-c", LEAN, package, f"--robot=http://{mock.address}", "--target=1,0"]
    command += ["--no-hold", f"--mock-speed={SPEED:g}", f"--log={tmp_path / 'log.mcap'}"]
    streams = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    with subprocess.Popen(command, **streams) as program:
        os.set_blocking(program.stdout.fileno(), False)
        eventually(lambda: b"Type yes:" in (program.stdout.read() or b""))
        program.send_signal(signal.SIGINT)

        assert program.wait(DEADLINE_S) == 130
    assert mock.get("/mock/truth")["commands"] == before


def test_a_safety_rule_ends_the_deployment(deploy, mock, tmp_path):
    """A policy that drives away from its target reaches the fence, which a script sees by the exit code."""
    astray = write_package(tmp_path / "astray", gain=-1.0)
    done = deploy("--target=0.5,0", *HANDS_OFF, package=astray)

    assert done.returncode == 3
    assert "fence: the robot at" in done.stderr
    assert mock.get("/mock/truth")["vx"] == 0.0
    assert {"decision": "stand", "cause": "fence"} in decisions(tmp_path / "log.mcap")


def test_the_robot_drives_only_while_a_key_is_held(mock, package, tmp_path):
    """Hold-to-run is the default. Ctrl-C ends the program, which then restores the terminal's mode."""
    leader, follower = pty.openpty()
    command = [sys.executable, "-c", LEAN, package, f"--robot=http://{mock.address}", "--target=1.2,0"]
    command += [f"--mock-speed={SPEED:g}", f"--log={tmp_path / 'log.mcap'}"]
    program = subprocess.Popen(command, stdin=follower, stdout=follower, stderr=follower, close_fds=True)
    shown = b""

    def seen(text):
        nonlocal shown
        shown += os.read(leader, 65_536)
        return text in shown

    try:
        eventually(lambda: seen(b"Type yes:"), pace_s=0.0)
        os.write(leader, b"yes\n")
        eventually(lambda: seen(b"hold the space bar"), pace_s=0.0)
        assert mock.get("/mock/truth")["x"] == 0.0

        ends = time.monotonic() + DEADLINE_S
        while mock.get("/mock/truth")["x"] < 0.2:
            assert time.monotonic() < ends
            os.write(leader, b" ")
        eventually(lambda: mock.get("/mock/truth")["vx"] == 0.0)
        stopped = mock.get("/mock/truth")["x"]
        assert stopped < 1.0

        program.send_signal(signal.SIGINT)
        assert program.wait(DEADLINE_S) == 130
        assert mock.get("/mock/truth")["x"] == pytest.approx(stopped, abs=0.01)
    finally:
        program.kill()
        program.wait()
        os.close(leader)
        os.close(follower)
