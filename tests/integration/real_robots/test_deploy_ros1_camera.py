"""A policy that sees, over ROS 1: a node of ours publishes the pictures of a mock robot."""

import contextlib
import math
import subprocess
import sys
import threading

import numpy as np
import pytest

from palaestra_trainer.bags.reader import read_bag
from palaestra_trainer.real_robots.command_loop import Hooks
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.ros1 import Ros1Link
from palaestra_trainer.real_robots.safety import SafetyRules
from palaestra_trainer.ros.publisher import RosPublisher
from palaestra_trainer.ros.topic_node import TopicNode
from tests.mock_robots import ARRIVED_M, DEADLINE_S, Client, ended, started
from tests.packages import write_seeing_package
from tests.waiting import eventually

SPEED = 1.0  # the age of a picture counts as many times as the clock of the robot is faster
TOPIC = "/usb_cam/image_raw"
SIZE = (80, 60)  # a small picture, because RosPublisher is for short messages
START = (-0.9, 0.1, 0.1)


@pytest.fixture
def mock(master):
    """Yield the client of a robot that sees the pole, whose driver has its default limits."""
    del master
    place = ",".join(map(str, START))
    process, client = started("--ros1", "--drift=0", f"--start={place}", f"--speed={SPEED:g}")
    yield client
    ended(process, client)


@pytest.fixture
def deploy(master, tmp_path):
    """Return a function that deploys a policy that sees; its arguments follow package and robot."""
    package = write_seeing_package(tmp_path / "package")
    command = [sys.executable, "-m", "palaestra_trainer.cli.deploy", package, "--start=-0.9,0.1,0.1"]
    command += [f"--robot={master.replace('http:', 'ros1:')}", "--target=0,0", "--yes", "--no-hold"]
    command += [f"--topic=image_raw={TOPIC}"]
    command += [f"--mock-speed={SPEED:g}", f"--log={tmp_path / 'log.mcap'}"]

    def run(*arguments):
        return subprocess.run(
            [*command, *arguments], capture_output=True, text=True, timeout=DEADLINE_S, check=False
        )

    return run


@contextlib.contextmanager
def camera(master, robot, encoding):
    """Publish the pictures of a mock robot in a thread, until the end of the context."""
    over, client = threading.Event(), Client(robot.address)
    node = TopicNode("/camera", master)
    publisher = RosPublisher(node, TOPIC, "sensor_msgs/Image")

    def publish():
        while not over.wait(0.01):
            pixels = encoded(client.picture(SIZE), encoding)
            width, height = SIZE
            publisher.publish(
                width=width, height=height, encoding=encoding, step=len(pixels) // height, data=pixels
            )

    thread = threading.Thread(target=publish)
    thread.start()
    try:
        yield
    finally:
        over.set()
        thread.join(DEADLINE_S)
        publisher.close()
        node.close()
        client.connection.close()


def encoded(pixels, encoding):
    """Return the bytes of an RGB picture in the encoding of a message."""
    if encoding == "mono8":
        return pixels.mean(axis=2).astype(np.uint8).tobytes()
    return np.dstack([pixels[:, :, ::-1], np.full(pixels.shape[:2], 255, np.uint8)]).tobytes()


def test_a_policy_that_sees_drives_over_ros(deploy, master, mock, tmp_path):
    """The camera has its own node, in another namespace than the driver's node."""
    with camera(master, mock, "bgra8"):
        done = deploy()

    assert done.returncode == 0, done.stderr
    assert "reached after" in done.stdout
    truth = mock.get("/mock/truth")
    assert math.hypot(truth["x"], truth["y"]) < ARRIVED_M
    first, *_, last = (each.content for each in read_bag(tmp_path / "log.mcap").topics["/camera/image"])
    assert (first["width"], first["height"], first["encoding"]) == (64, 48, "rgb8")
    assert redness(last) > 1.5 * redness(first)


def redness(image):
    """Return the mean of red minus green of a recorded image."""
    pixels = np.frombuffer(bytes(image["data"]), np.uint8).reshape(-1, 3).astype(float)
    return (pixels[:, 0] - pixels[:, 1]).mean()


def test_a_camera_without_colors_is_refused_before_the_robot_moves(deploy, master, mock):
    """The policy learned with colors, so a gray picture would be a different input."""
    with camera(master, mock, "mono8"):
        done = deploy()

    assert done.returncode == 2, done.stderr
    assert (
        "camera: the encoding 'mono8' does not have the colors that the policy sees; let the" in done.stderr
    )
    truth = mock.get("/mock/truth")
    assert (truth["x"], truth["y"]) == pytest.approx(START[:2])


def test_without_new_pictures_the_robot_is_held_back_until_the_camera_returns(master, mock):
    """A policy must not act on an old picture. If the camera's node restarts, the drive must continue."""
    causes = []
    clock, rules = RobotClock(SPEED), SafetyRules(lost_s=DEADLINE_S * SPEED)
    hooks = Hooks(decided=lambda _, decision: causes.append(decision.cause and decision.cause.name))
    link = Ros1Link(master.replace("http:", "ros1:"), clock=clock, topics={"image_raw": TOPIC})
    with RealRobotino(link, rules, clock=clock, hooks=hooks) as robot:
        with camera(master, mock, "bgra8"):
            robot.connect()
            robot.use_cameras(color=True)
            before = robot.color_image()
        eventually(lambda: "stale readings" in causes)
        mock.send("/mock/place", [*START[:2], math.pi])

        with camera(master, mock, "bgra8"):
            held_back = robot.advance()
        after = robot.color_image()

    assert held_back > 0
    assert before.tolist() != after.tolist()  # the robot has turned away from the pole
