"""The driver for ROS 1 of the mock robot as a program: its parameters, its registration and its end."""

import subprocess

import pytest

from palaestra_trainer.ros import Master, RosSubscriber
from palaestra_trainer.ros.publisher import RosPublisher
from palaestra_trainer.ros.topic_node import TopicNode
from tests.mock_robots import DEADLINE_S, PROGRAM, ended, started
from tests.waiting import eventually

FORWARD = {"linear": {"x": 0.2}}


@pytest.fixture(scope="module")
def mock(master):
    """Yield the client of a robot whose driver has its default limits."""
    del master
    process, client = started("--ros1", "--speed=2", "--drift=0", "--start=0,0,0")
    yield client
    process.terminate()
    assert process.wait(DEADLINE_S) == 0
    ended(process, client)
    assert Master("/test").publishers("/odom") == set()


@pytest.fixture
def commands(master, mock):
    """Yield a publisher of commands to which the driver is connected."""
    del mock
    node = TopicNode("/commander", master)
    publisher = RosPublisher(node, "/cmd_vel", "geometry_msgs/Twist")
    assert publisher.wait_for_subscriber(DEADLINE_S)
    yield publisher
    publisher.close()
    node.close()


@pytest.mark.usefixtures("mock")
def test_clients_read_the_limits_as_parameters():
    """A client must know the limit before it drives, because the driver clips without a notice."""
    limits = Master("/test").parameter("/robotino_node")

    assert limits == {
        "max_linear_vel": 0.2,
        "min_linear_vel": 0.05,
        "max_angular_vel": 1.0,
        "min_angular_vel": 0.1,
    }


def test_a_command_is_forwarded_once_and_the_robot_stops_itself(mock, commands):
    """The driver has no watchdog and repeats no command, so only the robot's dead man's switch stops it."""
    before = mock.get("/mock/truth")["commands"]
    commands.publish(**FORWARD)
    eventually(lambda: mock.get("/mock/truth")["commands"] > before, pace_s=0.005)
    sent_s = mock.get("/mock/truth")["last_command_s"]
    truth = eventually(lambda: later(mock, sent_s + 0.5), pace_s=0.005)

    assert truth["commands"] == before + 1
    assert truth["vx"] == 0.0


def later(mock, time_s):
    """Return the truth if it is later than a time; else None."""
    truth = mock.get("/mock/truth")
    return truth if truth["time_s"] > time_s else None


@pytest.mark.usefixtures("mock")
def test_the_topics_have_the_frames_of_the_driver():
    """Programs transform the points by the name of their frame."""
    odometry = RosSubscriber("/odom", "nav_msgs/Odometry", deadline_s=DEADLINE_S)
    points = RosSubscriber("/distance_sensors", "sensor_msgs/PointCloud", deadline_s=DEADLINE_S)
    for topic in (odometry, points):
        topic.connect()
    first, second, cloud = odometry.next(), odometry.next(), points.next()
    for topic in (odometry, points):
        topic.close()

    assert (first.header.frame_id, first.child_frame_id) == ("odom", "base_link")
    assert second.header.seq == first.header.seq + 1
    assert (cloud.header.frame_id, len(cloud.points)) == ("base_link", 9)
    assert cloud.points[0].x == pytest.approx(0.61)  # nothing is in range: 0.41 m, and 0.2 m to the sensor


def test_without_a_master_the_program_is_refused(monkeypatch):
    """The error must name both remedies: to start a master, or to set the variable ROS_MASTER_URI."""
    monkeypatch.setenv("ROS_MASTER_URI", "http://127.0.0.1:9")
    done = subprocess.run(
        [*PROGRAM, "--ros1"], capture_output=True, text=True, timeout=DEADLINE_S, check=False
    )

    assert done.returncode == 2
    assert done.stderr.startswith("palaestra-mock-robot: ROS_MASTER_URI: http://127.0.0.1:9: no ROS master")
    assert done.stderr.endswith("start palaestra-ros-master, or set the variable\n")
