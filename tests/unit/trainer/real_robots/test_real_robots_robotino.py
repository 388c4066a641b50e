"""A Robotino behind a fake link: what it refuses, and how long it waits."""

import numpy as np
import pytest

from palaestra_trainer.errors import LinkError, NoReading, NoSuchSensor, RobotStopped, RobotUnfit
from palaestra_trainer.real_robots.command_loop import Hooks
from palaestra_trainer.real_robots.readings import Odometry
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.robots.geometry import Pose
from tests.waiting import eventually

HERE = Pose(0.0, 0.0, 0.0)
AGES_S = 1e6  # added to the robot's time, so a reading stays new for the whole test
CLOCK = RobotClock(10.0)
REAL = RobotClock()  # at real speed, a thread that a busy computer delays does not look like a lost robot


class Link:
    """A link to a robot whose readings a test chooses; it accepts every command.

    Attributes:
        velocity: the velocity in the odometry.
        silent: whether no reading arrives.
    """

    address = "fake:robot"

    def __init__(self):
        self.velocity, self.silent = (0.0, 0.0, 0.0), False
        self.sent, self.sizes = [], []

    def refuse_unfit(self, speed_m_s, turn_rad_s):
        """Accept the robot."""

    def start(self, store):
        """Store one reading of each kind."""
        self.store = store
        if not self.silent:
            store.set_distances(np.ones(9, np.float32), self.late_s)
            store.set_bumped(self.late_s, bumped=False)
            self.report()

    @property
    def late_s(self):
        """Return the time of the readings, which is in the robot's future."""
        return CLOCK.now_s() + AGES_S

    def report(self):
        """Store odometry."""
        self.store.set_odometry(Odometry(HERE, self.velocity), self.late_s)

    def use_camera(self, store, size):
        """Store an image of the wanted size."""
        self.sizes.append(size)
        store.set_image(np.zeros((*size[::-1], 3), np.uint8), self.late_s)

    def send(self, twist):
        """Record a command."""
        self.sent.append(twist)

    def close(self):
        """Do nothing."""


@pytest.fixture
def robot():
    """Yield a function that returns a robot that is not connected, and its link."""
    made = []

    def make(clock=CLOCK, **hooks):
        link = Link()
        made.append(RealRobotino(link, clock=clock, hooks=Hooks(**hooks)))
        return made[-1], link

    yield make
    for each in made:
        each.close()


@pytest.mark.parametrize("reading", ["pose", "distances", "bumped"])
def test_a_reading_before_the_connection_is_refused(robot, reading):
    """A value of zero would look like a reading of the robot."""
    unconnected, _ = robot()

    with pytest.raises(NoReading, match=r"arrived; call connect\(\) first"):
        getattr(unconnected, reading)()


def test_a_robot_that_sends_nothing_is_refused_after_some_seconds(robot):
    """The address may belong to another program, and a person should check it."""
    silent, link = robot()
    link.silent = True

    with pytest.raises(RobotUnfit, match=r"fake:robot: sent no odometry, .* within 5 s; check the address"):
        silent.connect()
    assert link.sent == []


def test_a_robot_that_does_not_stop_names_the_emergency_stop(robot):
    """The next episode must not begin while the robot moves."""
    moving, link = robot()
    moving.connect()
    link.velocity = (0.3, 0.0, 0.0)
    link.report()

    with pytest.raises(RobotStopped, match="did not stop within 3 s; use its emergency stop"):
        moving.stand()
    assert set(link.sent) == {(0.0, 0.0, 0.0)}


def test_a_robot_that_confirms_no_command_names_the_cause(robot):
    """A person who only presses the emergency stop would meet the same fault in the next episode."""

    def refuse(twist):
        raise LinkError(f"{twist} was not confirmed")

    moving, link = robot()
    moving.connect()
    link.velocity = (0.015, 0.0, 0.0)  # it rolls, but no other client drives it
    link.report()
    link.send = refuse

    with pytest.raises(RobotStopped, match=r"^commands refused: .*; did not stop within 3 s; use its"):
        moving.stand()


def test_a_robot_that_is_held_back_too_long_ends_the_drive(robot, monkeypatch):
    """The person who holds the key has probably gone away, and the program should not wait for ever."""
    monkeypatch.setattr("palaestra_trainer.real_robots.robotino._MOST_HELD_BACK_S", 0.2)
    causes = []
    held, _ = robot(REAL, permitted=lambda: False, decided=lambda _, decision: causes.append(decision.cause))
    held.connect()
    held.drive(0.1, 0.0, 0.0)
    eventually(lambda: causes[-1:] != [None] and causes, pace_s=0.005)

    with pytest.raises(RobotStopped, match=r"held back for 0\.2 s: "):
        held.advance()


def test_a_camera_is_used_only_when_an_environment_wants_images(robot):
    """Images would use most of the bandwidth of the robot's network."""
    seeing, link = robot()
    seeing.connect()

    seeing.use_cameras()
    with pytest.raises(NoSuchSensor, match=r"not in use; call use_cameras\(color=True\) after connect"):
        seeing.color_image()
    seeing.use_cameras(color=True)

    assert link.sizes == [seeing.image_size]
    assert seeing.color_image().shape == (*seeing.image_size[::-1], 3)


def test_an_image_alone_is_not_a_pose(robot):
    """A camera may respond while odometry is late; the pose must not be that of the floor's middle."""
    seeing, link = robot()
    link.silent = True
    link.start(None)

    seeing.use_cameras(color=True)

    with pytest.raises(NoReading, match="odometry has not arrived"):
        seeing.pose()
