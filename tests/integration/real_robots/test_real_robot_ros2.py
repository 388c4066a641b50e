"""A Robotino over ROS 2: a small driver of the mock robot, the connection, and the policy as a node."""

import cmath
import json
import math
import shlex
import signal
import subprocess
import sys
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from palaestra_trainer.bags.reader import read_bag
from tests import ros2
from tests.mock_robots import ARRIVED_M, DEADLINE_S, ended, settled, started
from tests.packages import write_package, write_seeing_package
from tests.pages import blocks
from tests.waiting import TooLate, eventually

HERE = Path(__file__).parent
PAGE = (HERE.parents[2] / "docs/howto/ros2.md").read_text()
SPEED = 2.0
RADIUS_M = 0.2286


@contextmanager
def driver(client, namespace, *options, speed=SPEED):
    """Start a driver of a mock robot, and yield it when it is ready; its standard input takes goals."""
    words = [HERE / "ros2_driver.py", client.address, speed, *options]
    words += ["--ros-args", "-r", f"__ns:={namespace}"]
    program = ros2.start(*words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    try:
        assert program.stdout.readline() == "ready\n"
        yield program
    finally:
        leave(program)


@contextmanager
def node(package, kind, *arguments):
    """Yield a policy node, started as a block of the page does it, with its log."""
    [command] = blocks(PAGE, f"sh {kind}")
    program, shown, *words = shlex.split(command)
    assert (program, shown) == ("palaestra-policy-node", "package")
    log = package.parent / f"{kind}.log"
    with log.open("w") as errors:
        module = ("-m", "palaestra_trainer.cli.policy_node")
        program = ros2.start(*module, package, *words, *arguments, stderr=errors)
    try:
        wait_for(log, "ready; waiting for a goal")
        yield program, log
    finally:
        program.terminate()
        leave(program)


def leave(program):
    """Wait for the end of a program, because a killed program would leave its shared memory."""
    try:
        program.communicate(timeout=DEADLINE_S)
    finally:
        program.kill()
        program.wait()


def wait_for(log, words):
    """Wait until a log has these words."""
    try:
        eventually(lambda: words in log.read_text(), pace_s=0.01)
    except TooLate as error:
        raise AssertionError(log.read_text()) from error


def send(program, frame, goal):
    """Let the driver publish a goal."""
    program.stdin.write(f"{frame} {goal[0]} {goal[1]}\n")
    program.stdin.flush()


def of_odometry(client, x_m, y_m):
    """Return a point of the room in the frame of odometry, whose origin may be at any pose."""
    at_x, at_y, heading, *_ = client.get("/data/odometry")
    truth = client.get("/mock/truth")
    turned = cmath.rect(1.0, heading - truth["heading"])
    point = complex(at_x, at_y) + turned * (complex(x_m, y_m) - complex(truth["x"], truth["y"]))
    return point.real, point.imag


def driving(address):
    """Return a program that drives forward."""
    return ros2.start(HERE / "ros2_driving.py", address, SPEED, 0.5, stdout=subprocess.PIPE)


def found_by(program):
    """Wait for the end of a program, and return its output as data."""
    shown, _ = program.communicate(timeout=DEADLINE_S)
    return json.loads(shown)


@pytest.fixture(scope="module")
def running():
    """Yield a client of a fast mock robot with a perfect odometry, which all tests of this file share."""
    process, client = started(f"--speed={SPEED:g}", "--drift=0")
    yield client
    ended(process, client)


@pytest.fixture(scope="module")
def in_real_time():
    """Yield a client of a mock robot whose clock is that of this machine."""
    process, client = started("--drift=0")
    yield client
    ended(process, client)


@pytest.fixture(scope="module", autouse=True)
def lonely():
    """Yield a program that drives where no driver is; it waits for one while the other tests run."""
    program = driving("ros2:/absent")
    yield program
    leave(program)


@pytest.fixture(scope="module")
def package(tmp_path_factory):
    """Return a package whose policy drives to the target."""
    return write_package(tmp_path_factory.mktemp("ros2") / "package")


@pytest.mark.parametrize("options", [(), ("--best-effort",)], ids=["reliable", "best-effort"])
def test_the_robot_drives_over_topics(mock, options):
    """Some drivers publish their sensors with reliable QoS, and others with best effort; both must work."""
    with driver(mock, "/one", *options):
        found = found_by(driving("ros2:/one"))
        truth = mock.get("/mock/truth")

    assert found["x"] == pytest.approx(truth["x"], abs=1e-3)
    assert truth["x"] > 0.4
    assert truth["vx"] == 0.0
    assert found["distances"] == pytest.approx(mock.get("/data/distancesensorarray"), abs=0.05)
    assert found["bumped"] is False


def test_a_latched_bump_from_before_the_connection_is_noticed(mock):
    """A driver publishes the bumper only at a change. But the robot may touch a wall before we connect."""
    mock.send("/mock/place", [1.6, 0, 0])
    mock.send("/data/omnidrive", [0.5, 0, 0])
    eventually(lambda: (mock.send("/data/omnidrive", [0.5, 0, 0]), mock.get("/data/bumper")["value"])[1])
    with driver(mock, "/latched", "--latched"):
        found = found_by(driving("ros2:/latched"))

    assert found["bumped"] is True


def test_the_policy_node_drives_to_goals_in_the_time_of_clock(mock, package, tmp_path):
    """A simulation is often faster than real time, and then the node's period must be shorter too."""
    x_m, y_m = of_odometry(mock, 0.0, 0.0)
    fence = [x_m - 1.8, y_m - 1.8, x_m + 1.8, y_m + 1.8]
    fenced, bag = ("-p", f"fence:={fence}"), tmp_path / "node.mcap"
    with (
        driver(mock, "/robot1", "--clock") as robot,
        node(package, "in-a-simulation", *fenced, "--", "--record", bag) as (program, log),
    ):
        send(robot, "map", (x_m, y_m))
        wait_for(log, "goal ignored: its frame is map, but the frame of odometry is odom")
        send(robot, "odom", (x_m + 2.0, y_m))
        wait_for(log, "is too close to the fence")
        assert mock.get("/mock/truth")["x"] == 0.0

        begun = mock.get("/mock/truth")
        send(robot, "odom", of_odometry(mock, -1.0, 0.0))
        eventually(lambda: mock.get("/mock/truth")["x"] < -0.1, pace_s=0.01)
        send(robot, "odom", of_odometry(mock, 0.6, 0.4))
        wait_for(log, "reached after")
        truth = mock.get("/mock/truth")
        assert (truth["x"], truth["y"]) == pytest.approx((0.6, 0.4), abs=0.2)
        rate_hz = (truth["commands"] - begun["commands"]) / (truth["time_s"] - begun["time_s"])
        assert 10.0 < rate_hz < 22.0  # by the robot's clock, which is four times as fast as real time

        program.send_signal(signal.SIGINT)
        assert program.wait(DEADLINE_S) == 0
    topics = read_bag(bag).topics
    ends = [
        each.content["data"] for each in topics["/palaestra/decisions"] if "reached" in each.content["data"]
    ]
    assert len(ends) == 1
    assert topics["/palaestra/cmd_vel"][-1].content["linear"]["x"] == 0.0


def test_a_policy_that_sees_acts_on_published_images(in_real_time, tmp_path):
    """The camera's pictures have another size and order of colors than the policy's, and another topic.

    The robot moves in real time, because the age of a picture counts as many times as its clock is faster.
    """
    mock = settled(in_real_time)
    package, bag = write_seeing_package(tmp_path / "package"), tmp_path / "node.mcap"
    mock.send("/mock/place", [-1.3, 0.3, 0.2])
    front = ("--ros-args", "-r", "image_raw:=/front/image", "--")
    own = ("--", "--record", bag, "--topic", "image_raw=/front/image")
    with (
        driver(mock, "/robot1", "--clock", "--camera", *front, speed=1.0) as robot,
        node(package, "in-a-simulation", *own) as (program, log),
    ):
        send(robot, "odom", of_odometry(mock, 0.0, 0.0))
        wait_for(log, "reached after")
        truth = mock.get("/mock/truth")
        program.send_signal(signal.SIGINT)
        assert program.wait(DEADLINE_S) == 0

    assert math.hypot(truth["x"], truth["y"]) < ARRIVED_M
    first, *_, last = (each.content for each in read_bag(bag).topics["/camera/image"])
    assert (first["width"], first["height"], first["encoding"]) == (64, 48, "rgb8")
    assert redness(last) > 3.0 * redness(first)


def redness(image):
    """Return the mean of red minus green of a recorded image."""
    pixels = np.frombuffer(bytes(image["data"]), np.uint8).reshape(-1, 3).astype(float)
    return (pixels[:, 0] - pixels[:, 1]).mean()


def test_the_policy_node_is_quiet_without_a_goal_and_opens_no_network(in_real_time, package):
    """Without a goal, other nodes may drive the robot. Packets of tests must not leave this machine."""
    mock = settled(in_real_time)
    commands = mock.get("/mock/truth")["commands"]
    with driver(mock, "/", speed=1.0) as robot, node(package, "policy-node") as (program, log):
        assert mock.get("/mock/truth")["commands"] == commands
        send(robot, "odom", of_odometry(mock, 0.3, 0.0))
        wait_for(log, "reached after")
        assert 0.05 < mock.get("/mock/truth")["x"] < 0.3
        assert network_sockets(program.pid) == []
        program.send_signal(signal.SIGTERM)
        assert program.wait(DEADLINE_S) == 0
        assert mock.get("/mock/truth")["vx"] == 0.0


def network_sockets(pid):
    """Return the sockets of TCP and UDP that a process has open."""
    links = [str(link.readlink()) for link in Path(f"/proc/{pid}/fd").iterdir() if link.is_symlink()]
    found = []
    for table in ("tcp", "tcp6", "udp", "udp6"):
        rows = [line.split() for line in Path(f"/proc/{pid}/net/{table}").read_text().splitlines()[1:]]
        found += [f"{table} {row[1]}" for row in rows if f"socket:[{row[9]}]" in links]
    return found


def test_a_robot_without_a_driver_is_refused(lonely):
    """A wrong namespace is the usual mistake."""
    found = found_by(lonely)

    assert found["error"] == (
        "RobotUnfit: ros2:/absent: no odometry arrives on /absent/odom; start the robot's driver, and "
        "compare the namespace and ROS_DOMAIN_ID"
    )


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ([], "rclpy is not installed; source the setup file of your ROS 2"),
        (["--topic=pose=/p"], "--topic: 'pose' is neither read nor published; use one of bumper, cmd_vel"),
    ],
)
def test_without_rclpy_or_with_an_unknown_topic_the_message_names_the_remedy(package, options, message):
    """Most users of this program have ROS 2, but have not sourced it in this terminal."""
    done = subprocess.run(
        [sys.executable, "-m", "palaestra_trainer.cli.policy_node", package, *options],
        check=False,
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
    )

    assert done.returncode == 2
    assert message in done.stderr
