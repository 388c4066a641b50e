"""A Robotino over REST: the mock robot, with the habits of a real one, behind the interface of robots."""

import math
import signal

import numpy as np
import pytest

from palaestra_trainer.errors import ConfigurationError, RobotStopped, RobotUnfit
from palaestra_trainer.real_robots.command_loop import Hooks
from palaestra_trainer.real_robots.rest import RestLink
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.robotino import RealRobotino
from palaestra_trainer.real_robots.safety import Fence, SafetyRules
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.testing.conformance import check_robot
from tests.dead_man import LIMITS_S, after, driver
from tests.mock_robots import DEADLINE_S, SPEED, Cable, drive
from tests.waiting import eventually


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


def speeds(robot, mock, twist, periods):
    """Drive for some periods; return the robot's true speeds at their ends.

    A loaded machine delays readings, and without new readings the robot is held back for a moment.
    """
    found = []
    for _ in range(periods):
        drive(robot, twist, 1)
        found.append(mock.get("/mock/truth")["vx"])
    return found


def test_the_real_robot_keeps_the_rules_of_every_robot(robot):
    """An environment uses a simulated and a real robot in the same way."""
    check_robot(robot())


def test_odometry_is_shifted_to_where_the_person_placed_the_robot(robot, mock):
    """A robot's odometry may begin at any pose, and REST has no request to reset it."""
    real = robot()
    real.stand_at(Pose(1.0, 2.0, math.pi / 2.0))
    drive(real, (0.5, 0.0, 0.0), 5)
    real.stand()
    real.advance()

    truth = mock.get("/mock/truth")
    assert real.pose().x_m == pytest.approx(1.0, abs=1e-3)
    assert real.pose().y_m == pytest.approx(2.0 + truth["x"], abs=1e-3)
    assert truth["x"] > 0.3


def test_the_speed_limit_holds_for_the_robot_itself(robot, mock):
    """The policy commands 0.5 m/s, but the robot must not drive faster than the limit of 0.2 m/s."""
    assert max(speeds(robot(speed_m_s=0.2), mock, (0.5, 0.0, 0.0), 6)) == pytest.approx(0.2)


def test_the_robot_stands_after_a_bump_and_says_so(robot, mock):
    """The environment ends the episode as a collision, so `advance` does not raise an error."""
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
    """The fence is smaller than the floor, so nothing but the rule stops this robot."""
    real = robot(fence=Fence((-0.6, -0.6), (0.6, 0.6)))

    with pytest.raises(RobotStopped, match=r"fence: the robot at .* of the fence; move it back, or widen"):
        drive(real, (0.5, 0.0, 0.0), 20)

    eventually(lambda: mock.get("/mock/truth")["vx"] == 0.0, pace_s=0.005)
    assert mock.get("/mock/truth")["x"] < 0.6 - 0.2286


def test_a_robot_drives_only_while_the_person_permits_it(robot, mock):
    """While the key is released, the robot must stand, and its policy waits for some periods."""
    permitted = iter([*[True] * 20, *[False] * 20, *[True] * 1000])
    real = robot(hooks=Hooks(permitted=lambda: next(permitted)))
    extra = []
    for _ in range(12):
        real.drive(0.2, 0.0, 0.0)
        extra.append(real.advance())

    assert sum(extra) >= 4
    assert max(speeds(real, mock, (0.2, 0.0, 0.0), 6)) > 0.0


def test_a_robot_at_its_charger_is_refused(robot, mock):
    """A robot that drives would tear the cable of its charger."""
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
    """Two seconds without readings are longer than a usual delay, so a person must look at the robot."""
    with Cable(mock) as cable:
        real = robot(cable.url)
        cable.cut()
        with pytest.raises(RobotStopped, match=r"connection lost: no .* for 2 s.*; check the network"):
            drive(real, (0.2, 0.0, 0.0), 40)


def test_a_short_bump_ends_the_episode_too(robot, mock):
    """The bumper may be released again before the policy looks, and the robot stays stopped."""
    real = robot()
    drive(real, (0.2, 0.0, 0.0), 1)
    mock.send("/mock/place", [1.76, 0, 0])
    eventually(lambda: mock.get("/mock/truth")["contacts"] and real.advance() is not None and real.bumped())
    mock.send("/mock/place", [0, 0, 0])
    drive(real, (0.2, 0.0, 0.0), 3)

    assert real.bumped()
    assert mock.get("/mock/truth")["vx"] == 0.0


def test_the_numbers_of_a_policy_may_be_those_of_numpy(robot, mock):
    """A user's environment may pass numbers of NumPy from an action without a conversion."""
    found = speeds(robot(), mock, np.array([0.2, 0.0, 0.0], np.float32), 6)

    assert max(found) == pytest.approx(0.2)


def test_an_error_in_the_thread_of_the_commands_reaches_the_program(robot, mock):
    """Without the error, the policy would command a standing robot until the end of the episode's time."""

    def decided(situation, decision):
        del decision
        if situation.command is not None:
            raise ZeroDivisionError

    real = robot(hooks=Hooks(decided=decided))
    with pytest.raises(RobotStopped, match="internal error: ZeroDivisionError"):
        drive(real, (0.2, 0.0, 0.0), 5)

    assert mock.get("/mock/truth")["vx"] == 0.0


def test_after_a_pause_the_policy_looks_before_the_robot_moves(robot):
    """The policy chose the last command before the pause, so the command may be wrong now."""
    permitted, sent = [True], []

    def decided(situation, decision):
        del situation
        sent.append(decision.twist[0])

    real = robot(hooks=Hooks(permitted=lambda: permitted[0], decided=decided))
    drive(real, (0.2, 0.0, 0.0), 2)
    permitted[0] = False
    eventually(lambda: sent[-3:] == [0.0] * 3, pace_s=0.001)
    permitted[0] = True
    count = len(sent)
    eventually(lambda: len(sent) > count + 5, pace_s=0.001)

    assert not any(sent[count:])


def test_the_last_command_of_a_dry_run_is_not_sent(mock):
    """The policy chose this command before the person agreed to a motion of the robot."""
    sent = []
    hooks = Hooks(decided=lambda _, decision: sent.append(decision.twist))
    clock = RobotClock(SPEED)
    link = RestLink(f"http://{mock.address}", clock=clock)
    with RealRobotino(link, SafetyRules(), clock=clock, hooks=hooks) as real:
        real.connect(muted=True)
        drive(real, (0.2, 0.0, 0.0), 2)
        real.unmute()
        count = len(sent)
        eventually(lambda: len(sent) > count + 3, pace_s=0.001)

    assert not any(map(any, sent))


def test_a_new_episode_begins_where_odometry_says(robot, mock):
    """After the last step, the robot may have rolled on, or a person may have pushed it."""
    real = robot()
    drive(real, (0.5, 0.0, 0.0), 3)
    real.begin()

    assert real.pose().x_m == pytest.approx(mock.get("/mock/truth")["x"], abs=1e-6)


@pytest.mark.parametrize(
    "address",
    ["http://robot/?x=1", "http://me@robot", "https://robot", "robot", "http://robot/api", "http://[::"],
)
def test_an_address_that_is_more_than_a_host_is_refused(address):
    """A request would go to another path than that of a Robotino."""
    with pytest.raises(ConfigurationError, match="is not an address such as"):
        RestLink(address)


@pytest.mark.parametrize("host", ["999.1.1.1", "a..b", "no-such-host.invalid"])
def test_a_name_without_an_address_is_refused(host):
    """The program resolves the name only once, before the robot moves, so the error must come then."""
    with pytest.raises(RobotUnfit, match="has no address"):
        RealRobotino(RestLink(f"http://{host}")).connect()


def test_an_address_without_a_robot_is_refused():
    """The usual mistake is the address of another computer."""
    with pytest.raises(RobotUnfit, match="check the address, and that the robot is switched on"):
        RealRobotino(RestLink("http://127.0.0.1:9")).connect()


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_commands_the_robot_to_stand_before_the_program_ends(mock, number):
    """In an emergency, a person types Ctrl-C, so a signal must stop the robot before the program ends."""
    with driver(f"http://{mock.address}", SPEED) as program:
        program.send_signal(number)

        assert program.wait(DEADLINE_S) == 1
        assert mock.get("/mock/truth")["vx"] == 0.0


def test_an_error_of_the_policy_commands_the_robot_to_stand(mock):
    """The exception ends the robot's `with` block, which commands zero before the program ends."""
    with driver(f"http://{mock.address}", SPEED, "raise") as program:
        assert program.wait(DEADLINE_S) == 1
        assert mock.get("/mock/truth")["vx"] == 0.0


@pytest.mark.parametrize("what", ["kill", "cut", "hang"])
def test_the_robot_stands_soon_after(what):
    """If a policy hangs, our watchdog stops the robot.

    After a kill of the program or a cut of the cable, the robot's dead man's switch does.
    """
    assert after(what) < LIMITS_S[what]
