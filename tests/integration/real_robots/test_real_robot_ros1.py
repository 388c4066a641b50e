"""A Robotino over ROS 1: the driver of the mock robot, a ROS master of ours, and no installed ROS."""

import contextlib
import time
import xmlrpc.client

import pytest

from palaestra_trainer.errors import LinkError, RobotUnfit
from palaestra_trainer.real_robots.readings import ReadingStore
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.ros1 import Ros1Link
from palaestra_trainer.real_robots.safety import SafetyRules
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.ros import Master, RosSubscriber
from palaestra_trainer.ros.publisher import RosPublisher
from palaestra_trainer.ros.topic_node import TopicNode
from palaestra_trainer.testing.conformance import check_robot
from tests import cut_network
from tests.mock_robots import DEADLINE_S, drive, ended, started
from tests.waiting import eventually

SPEED = 2.0
OPTIONS = ("--ros1", "--drift=0", f"--speed={SPEED:g}")
PACE_S = 0.005  # short, because the robot's time passes faster than that of this machine


@contextlib.contextmanager
def mock_in(namespace, *options):
    """Yield the client of a mock robot whose driver is in a namespace."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_NAMESPACE", namespace)
        process, client = started(*OPTIONS, *options)
    try:
        yield client
    finally:
        process.terminate()
        process.wait(DEADLINE_S)
        ended(process, client)


@pytest.fixture(scope="module")
def running(master):
    """Yield the client of a robot whose driver allows 0.5 m/s, as the usual launch file does."""
    del master
    with mock_in("", "--max-speed=0.5") as client:
        yield client


@pytest.fixture
def mock(running):
    """Return the client of a robot that stands in the middle of the arena."""
    running.send("/data/omnidrive", [0, 0, 0])
    running.send("/mock/place", [0, 0, 0])
    eventually(lambda: stands(running), pace_s=PACE_S)
    return running


@pytest.fixture(scope="module")
def running_slowly(master):
    """Yield the client of a robot whose driver has the default limits, in the namespace /lab/slow."""
    del master
    with mock_in("lab/slow") as client:
        yield client


@pytest.fixture
def slow(running_slowly):
    """Return the client of the robot in /lab/slow, which stands."""
    eventually(lambda: stands(running_slowly), pace_s=PACE_S)
    return running_slowly


@pytest.fixture
def robot(master):
    """Yield a function that returns a connected robot; its keywords are safety rules."""
    made = []

    def make(namespace="", **rules):
        robot = real(address(master, namespace), **rules)
        made.append(robot)
        robot.connect()
        return robot

    yield make
    for each in made:
        each.close()


@pytest.fixture
def link(master):
    """Yield a function that returns a link and the store of its readings."""
    made = []

    def make(namespace=""):
        link, store = Ros1Link(address(master, namespace), clock=RobotClock(SPEED)), ReadingStore()
        made.append(link)
        link.start(store)
        return link, store

    yield make
    for each in made:
        each.close()


def address(master, namespace=""):
    """Return the address of a robot at the master of this process."""
    return master.replace("http:", "ros1:").rstrip("/") + namespace


def real(where, **rules):
    """Return a robot that is not connected."""
    clock = RobotClock(SPEED)
    return RealRobotino(Ros1Link(where, clock=clock), SafetyRules(**{"speed_m_s": 0.5} | rules), clock=clock)


def stands(client):
    """Return whether the robot stands."""
    truth = client.get("/mock/truth")
    return truth["vx"] == truth["vy"] == truth["omega"] == 0.0


def keep(link, twist, until):
    """Send a velocity again and again until a condition is true; return the condition's value."""

    def sent():
        link.send(twist)
        return until()

    return eventually(sent, pace_s=PACE_S)


def driven_back(robot, client):
    """Drive backward for a period; return whether the robot then moves backward."""
    drive(robot, (-0.5, 0.0, 0.0), 1)
    return client.get("/mock/truth")["vx"] < 0.0


def test_the_robot_keeps_the_rules_of_every_robot_over_ros(robot, mock):
    """An environment uses a robot over REST and over ROS in the same way."""
    del mock
    check_robot(robot())


def test_the_robot_drives_forward_and_stands_after_the_end(robot, mock):
    """The end of the context commands zero, and the topic of commands is unregistered."""
    with robot() as real_robot:
        real_robot.stand_at(Pose(1.0, 2.0, 0.0))
        drive(real_robot, (0.5, 0.0, 0.0), 5)
        real_robot.stand()
        real_robot.advance()
        pose = real_robot.pose()
        eventually(lambda: driven_back(real_robot, mock))
    after = mock.get("/mock/truth")

    assert pose.x_m - 1.0 > 0.3
    assert (after["vx"], after["vy"], after["omega"]) == (0.0, 0.0, 0.0)
    assert Master("/test").publishers("/cmd_vel") == set()


def test_a_wall_presses_the_bumper_over_ros(link, mock):
    """The driver publishes the bumper only at a change, so other messages confirm the bumper's last state."""
    mock.send("/mock/place", [1.6, 0, 0])
    connected, store = link()
    assert eventually(lambda: store.newest.oldest_s > 0.0, pace_s=PACE_S)
    before = store.newest.bumped
    keep(connected, (0.5, 0.0, 0.0), lambda: store.newest.bumped)
    hit_s = store.newest.odometry_s
    eventually(lambda: store.newest.bumped_s > hit_s + 0.5, pace_s=PACE_S)

    assert before is False
    assert store.newest.bumped is True
    _, late = link()
    assert eventually(lambda: late.newest.bumped, pace_s=PACE_S) is True  # a latched message reports the bump


def test_the_driver_clips_what_is_faster_than_its_limit(link, slow):
    """The driver does not report the clipping, so a program must read the limit before the drive."""
    connected, _ = link("/lab/slow")
    speeds = []

    def settled():
        speeds.append(slow.get("/mock/truth")["vx"])
        return len(speeds) > 20 and max(speeds) > 0.19

    keep(connected, (0.5, 0.0, 0.0), settled)

    assert max(speeds) == pytest.approx(0.2)


def test_a_driver_with_a_lower_limit_is_refused(master, slow):
    """The robot would be slower than in the simulation, and the policy would fail without an error."""
    del slow
    where = address(master, "/lab/slow")
    message = r"/lab/slow/robotino_node/max_linear_vel is 0\.2 m/s, below 0\.5 m/s; set the parameter and"
    with pytest.raises(RobotUnfit, match=message), real(where) as refused:
        refused.connect()


def test_a_driver_with_its_limit_at_the_speed_of_the_rules_is_used(robot, slow):
    """By default, the safety rules and the driver have the same limit, so this common case must work."""
    real_robot = robot("/lab/slow", speed_m_s=0.2)

    def speed():
        drive(real_robot, (0.5, 0.0, 0.0), 1)
        return slow.get("/mock/truth")["vx"]

    eventually(lambda: speed() == pytest.approx(0.2), pace_s=0.0)


def test_a_limit_that_nobody_has_set_is_the_drivers_default(master, slow):
    """The driver does not write its default into the parameter, so the parameter may be missing."""
    del slow
    with xmlrpc.client.ServerProxy(master) as server:
        server.deleteParam("/test", "/lab/slow/robotino_node/max_linear_vel")
    link = Ros1Link(address(master, "/lab/slow"))
    link.refuse_unfit(0.2, 1.0)

    with pytest.raises(RobotUnfit, match=r"max_linear_vel is 0\.2 m/s by default, below 0\.3 m/s"):
        link.refuse_unfit(0.3, 1.0)
    with pytest.raises(RobotUnfit, match=r"max_angular_vel is 1\.0 rad/s.*, below 2 rad/s"):
        link.refuse_unfit(0.2, 2.0)


def test_without_a_master_the_robot_is_refused():
    """The usual mistake is the address of another computer."""
    message = r"ros1://127\.0\.0\.1:9: no ROS master responds at .* check the address, and that the robot is"
    with pytest.raises(RobotUnfit, match=message):
        real("ros1://127.0.0.1:9").connect()


def test_without_a_driver_the_robot_is_refused(master):
    """A master alone drives nothing, and a wrong namespace looks the same."""
    topics = "publishes /nowhere/odom and subscribes to /nowhere/cmd_vel"
    message = f"/nowhere: no node that this computer reaches {topics}; start robotino_node"
    with pytest.raises(RobotUnfit, match=message):
        real(address(master, "/nowhere")).connect()


def test_a_command_that_nobody_receives_is_an_error(master):
    """With the error, the loop that sends commands can report that no driver confirmed the command."""
    link = Ros1Link(address(master))

    with pytest.raises(LinkError, match="/cmd_vel: the driver is not connected"):
        link.send((0.1, 0.0, 0.0))
    link.close()


@pytest.fixture
def other_node(master):
    """Yield a node of another person."""
    node = TopicNode("/joystick", master)
    yield node
    node.close()


def test_another_publisher_of_commands_is_refused_before_the_robot_moves(master, mock, other_node):
    """The driver obeys every publisher, so two of them would pull the robot to and fro."""
    before = mock.get("/mock/truth")["commands"]
    message = r"/joystick publishes /cmd_vel, so it can move the robot; end this node"
    with (
        contextlib.closing(RosPublisher(other_node, "/cmd_vel", "geometry_msgs/Twist")),
        pytest.raises(RobotUnfit, match=message),
        real(address(master)) as refused,
    ):
        refused.connect()

    Ros1Link(address(master)).refuse_unfit(0.5, 1.0)
    assert mock.get("/mock/truth")["commands"] == before


def test_a_recorder_of_commands_is_not_the_driver(master, link, other_node):
    """`rosbag record -a` subscribes to the topic of commands too, but must not be taken for the driver."""
    topic = "/lab/recorded/cmd_vel"
    with mock_in("lab/recorded"):
        connected, _ = link("/lab/recorded")
        with contextlib.closing(RosSubscriber(topic, "geometry_msgs/Twist", node=other_node)) as recorder:
            recorder.connect()
            driver_uri = other_node.master.node_uri("/lab/recorded/robotino_node")
            with xmlrpc.client.ServerProxy(driver_uri) as driver:
                driver.shutdown("/test", "the driver alone")
            with pytest.raises(LinkError, match="the driver is not connected"):
                keep(connected, (0.0, 0.0, 0.0), lambda: False)
            heard = eventually(recorder.arrived, pace_s=PACE_S)

            with pytest.raises(RobotUnfit, match="no node that this computer reaches publishes"):
                Ros1Link(address(master, "/lab/recorded")).refuse_unfit(0.2, 1.0)

    assert heard


@pytest.mark.skipif(cut_network.lack() is not None, reason="this machine has no network namespaces")
@pytest.mark.parametrize("time", range(3))
def test_the_robot_stands_soon_after_its_network_was_cut(time):
    """The driver has no watchdog and does not notice the cut, so only the base's dead man's switch acts."""
    del time

    assert cut_network.after_cut_s() < cut_network.LIMIT_S


def test_a_driver_that_starts_again_is_found(link):
    """A driver may crash and restart during a drive; when new readings arrive, the drive must continue."""
    with mock_in("lab/again"):
        connected, store = link("/lab/again")
        eventually(lambda: store.newest.oldest_s > 0.0, pace_s=PACE_S)
    gone_s = time.monotonic() * SPEED
    with pytest.raises(LinkError):
        keep(connected, (0.1, 0.0, 0.0), lambda: False)

    with mock_in("lab/again") as again:
        eventually(lambda: store.newest.oldest_s > gone_s, pace_s=PACE_S)
        eventually(lambda: subscribed(connected), pace_s=PACE_S)
        assert keep(connected, (0.1, 0.0, 0.0), lambda: again.get("/mock/truth")["vx"] > 0.09)


def subscribed(link):
    """Return whether a driver receives commands."""
    with contextlib.suppress(LinkError):
        link.send((0.0, 0.0, 0.0))
        return True
    return False
