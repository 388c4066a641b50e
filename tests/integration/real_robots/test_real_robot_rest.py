"""A Robotino over REST: the mock robot, with the habits of a real one, behind the interface of robots."""

import math
import signal

import pytest

from palaestra_trainer.errors import RobotStopped, RobotUnfit
from palaestra_trainer.real_robots.command_loop import Hooks
from palaestra_trainer.real_robots.rest import RestLink
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.safety import Fence, SafetyRules
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.testing.conformance import check_robot
from tests.dead_man import LIMITS_S, after, driver
from tests.mock_robots import DEADLINE_S, Cable, ended, started
from tests.waiting import eventually

SPEED = 5.0


@pytest.fixture(scope="module")
def running():
    """Yield a client of a fast mock robot with a perfect odometry, which all tests of this file share."""
    process, client = started(f"--speed={SPEED:g}", "--drift=0")
    yield client
    ended(process, client)


@pytest.fixture
def mock(running):
    """Return the client of a robot that stands in the middle of the arena, without a charger."""
    running.send("/data/omnidrive", [0, 0, 0])
    running.send("/mock/charger", {"connected": False})
    running.send("/mock/place", [0, 0, 0])
    eventually(lambda: running.get("/mock/truth")["vx"] == 0.0, pace_s=0.005)
    return running


@pytest.fixture
def robot(mock):
    """Yield a function that returns a connected robot; its keywords are safety rules."""
    made = []

    def make(address=None, hooks=None, **rules):
        clock = RobotClock(SPEED)
        link = RestLink(address or f"http://{mock.address}", clock=clock)
        robot = RealRobotino(link, SafetyRules(**{"speed_m_s": 0.5} | rules), clock=clock, hooks=hooks)
        made.append(robot)
        robot.connect()
        return robot

    yield make
    for each in made:
        each.close()


def drive(robot, twist, periods):
    """Drive at a velocity for some periods."""
    for _ in range(periods):
        robot.drive(*twist)
        robot.advance()


def test_the_real_robot_keeps_the_rules_of_every_robot(robot):
    """An environment uses a simulated and a real robot in the same way."""
    check_robot(robot())


def test_odometry_is_shifted_to_where_the_person_placed_the_robot(robot, mock):
    """Odometry begins anywhere, and REST has no request that resets it."""
    real = robot()
    real.stand_at(Pose(1.0, 2.0, math.pi / 2.0), placed=True)
    drive(real, (0.5, 0.0, 0.0), 5)
    real.stand()
    real.advance()

    truth = mock.get("/mock/truth")
    assert real.pose().x_m == pytest.approx(1.0, abs=1e-3)
    assert real.pose().y_m == pytest.approx(2.0 + truth["x"], abs=1e-3)
    assert truth["x"] > 0.3


def test_the_speed_limit_holds_for_the_robot_itself(robot, mock):
    """Until a person raises it, the limit is 0.2 m/s, and the policy wants 0.5."""
    real = robot(speed_m_s=0.2)
    drive(real, (0.5, 0.0, 0.0), 6)

    assert mock.get("/mock/truth")["vx"] == pytest.approx(0.2)


def test_the_robot_stands_after_a_bump_and_says_so(robot, mock):
    """The environment ends the episode as a collision, so this is no error."""
    mock.send("/mock/place", [1.6, 0, 0])
    real = robot()
    for _ in range(20):
        drive(real, (0.5, 0.0, 0.0), 1)
        if real.bumped():
            break

    assert real.bumped()
    drive(real, (-0.5, 0.0, 0.0), 3)
    assert mock.get("/mock/truth")["vx"] == 0.0


def test_the_robot_does_not_leave_its_fence(robot, mock):
    """The fence ends before the floor does."""
    real = robot(fence=Fence((-0.6, -0.6), (0.6, 0.6)))

    with pytest.raises(RobotStopped, match=r"fence: the robot at .* of the fence; move it back, or widen"):
        drive(real, (0.5, 0.0, 0.0), 20)

    eventually(lambda: mock.get("/mock/truth")["vx"] == 0.0, pace_s=0.005)
    assert mock.get("/mock/truth")["x"] < 0.6 - 0.2286


def test_a_robot_drives_only_while_the_person_permits_it(robot, mock):
    """Extra periods pass while the key is released, and the policy goes on after that."""
    permitted = iter([*[True] * 20, *[False] * 20, *[True] * 1000])
    real = robot(hooks=Hooks(permitted=lambda: next(permitted)))
    extra = []
    for _ in range(12):
        real.drive(0.2, 0.0, 0.0)
        extra.append(real.advance())

    assert sum(extra) >= 4
    assert mock.get("/mock/truth")["vx"] > 0.0


def test_a_robot_at_its_charger_is_refused(robot, mock):
    """It would tear the cable."""
    mock.send("/mock/charger", {"connected": True})

    with pytest.raises(RobotUnfit, match="is connected to its charger; unplug"):
        robot()


def test_a_robot_that_another_client_drives_is_refused(robot, mock):
    """REST has no lock, so two clients would drive in turns."""
    url = f"http://{mock.address}"
    with driver(url, SPEED), pytest.raises(RobotUnfit, match="the robot moves; end the other client"):
        robot()


def test_a_velocity_that_is_not_finite_ends_the_drive(robot, mock):
    """A diverged policy returns NaN; the robot must stand, and the person must learn why."""
    real = robot()
    with pytest.raises(RobotStopped, match="a velocity must be finite"):
        real.drive(math.nan, 0.0, 0.0)

    assert mock.get("/mock/truth")["vx"] == 0.0


def test_a_robot_without_a_connection_is_lost(robot, mock):
    """Two seconds without readings are no short delay, so a person must look."""
    with Cable(mock) as cable:
        real = robot(cable.url)
        cable.cut()
        with pytest.raises(RobotStopped, match="connection lost: no readings for 2 s; check the network"):
            drive(real, (0.2, 0.0, 0.0), 40)


def test_an_address_without_a_robot_is_refused():
    """The usual mistake is the address of another computer."""
    with pytest.raises(RobotUnfit, match="check the address, and that the robot is switched on"):
        RealRobotino(RestLink("http://127.0.0.1:9")).connect()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_commands_the_robot_to_stand_before_the_program_ends(mock, number):
    """Ctrl-C is the fastest way in which a person ends a program."""
    with driver(f"http://{mock.address}", SPEED) as program:
        program.send_signal(number)

        assert program.wait(DEADLINE_S) == 1
        assert mock.get("/mock/truth")["vx"] == 0.0


def test_an_error_of_the_policy_commands_the_robot_to_stand(mock):
    """The exception passes the robot's context, which sends zero before the program ends."""
    with driver(f"http://{mock.address}", SPEED, "raise") as program:
        assert program.wait(DEADLINE_S) == 1
        assert mock.get("/mock/truth")["vx"] == 0.0


@pytest.mark.parametrize("what", LIMITS_S)
def test_the_robot_stands_soon_after(what):
    """A killed program and a cut cable leave only the robot's dead man; a hung policy leaves our watchdog."""
    assert after(what) < LIMITS_S[what]
