"""Two starts of MuJoCo with one seed and equal commands publish equal messages, except for the stamps."""

import math

import pytest

from palaestra_trainer.robots import Pose
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import PERIOD_MS, SimulatedScene
from palaestra_trainer.ros import RosService, RosSubscriber
from palaestra_trainer.webots import Mode, Webots
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher

STEPS = 20
START = Pose(0.9, 0.3, 0.2)  # so close to a wall that the robot reaches it
STAMP = slice(4, 12)  # the bytes of the stamp, after the number in the header
DEADLINE_S = 30.0
IMAGE, RANGE = "sensor_msgs/Image", "sensor_msgs/Range"
FLOAT, BOOL = "webots_ros/Float64Stamped", "webots_ros/BoolStamped"
TOPICS = {
    "camera/image": IMAGE,
    "depth_camera/range_image": IMAGE,
    "touch_sensor/value": BOOL,
    **{f"ir{number}/value": RANGE for number in range(1, 10)},
    **{f"wheel{number}_joint_sensor/value": FLOAT for number in range(3)},
}


@pytest.fixture
def messages(master):
    """Return a function that starts a simulator with a seed and returns its messages by topic."""
    del master

    def messages(seed):
        launcher = ProcessLauncher("seeing", driver="mujoco")
        webots = Webots("robotino", "seeing", launcher=launcher, start_deadline_s=DEADLINE_S)
        robot = Robotino(webots)
        try:
            webots.start()
            webots.supervisor.set_mode(Mode.FAST)
            return listen(SimulatedScene(webots, robot), robot, seed)
        finally:
            robot.close()
            webots.stop()
            webots.close()
            launcher.close()

    return messages


def listen(scene, robot, seed):
    """Begin an episode, drive in curves into a wall, and return all messages by topic."""
    topics = {path: RosSubscriber(f"/robotino/{path}", kind, bytes) for path, kind in TOPICS.items()}
    for path in TOPICS:
        enable = RosService(f"/robotino/{path.partition('/')[0]}/enable", "webots_ros/set_int")
        assert enable(value=PERIOD_MS).success
        enable.close()
    scene.reset(seed, START, (-1.0, 0.0))
    for topic in topics.values():
        topic.connect()
    heard = {path: [] for path in TOPICS}
    for step in range(STEPS):
        robot.drive(0.5, 0.2 * math.sin(step), math.cos(step))
        robot.advance()
        for path, topic in topics.items():
            heard[path].append(unstamped(topic.next()))
    for topic in topics.values():
        topic.close()
    return heard


def unstamped(message):
    """Return a message without the stamp in its header."""
    return message[: STAMP.start] + message[STAMP.stop :]


def test_two_starts_with_one_seed_send_equal_messages(messages):
    """The messages contain images, noise, contacts and encoders, which all change in this world."""
    first, second = messages(3), messages(3)

    assert [path for path in TOPICS if first[path] != second[path]] == []
    assert all(len(set(first[path])) > 1 for path in TOPICS)
    assert {message[-1] for message in first["touch_sensor/value"]} == {0, 1}
