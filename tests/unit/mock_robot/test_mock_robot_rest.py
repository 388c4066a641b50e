"""The routes of the mock robot, and the delays of its network, without sockets."""

from random import Random

import pytest

from palaestra_sim.mock_robot.pace import Clock
from palaestra_sim.mock_robot.rest import PoorNetwork, routes
from palaestra_sim.mock_robot.robot import Habits, MockRobot
from palaestra_sim.mock_robot.server import BadRequestError
from palaestra_sim.world import builtin_path

CLOCK = Clock(10.0)
DRIVE = ("PUT", "/data/omnidrive")


@pytest.fixture
def robot():
    """Return a robot in the arena."""
    return MockRobot(builtin_path("arena"), Habits())


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"stop",
        b"[1, 2]",
        b"[1, 2, 3, 4]",
        b'{"vx": 1}',
        b"[1, 2, null]",
        b"[1, 2, true]",
        b"[NaN, 0, 0]",
        b"[0, Infinity, 0]",
        b"[0, 0, 1" + 400 * b"0" + b"]",
        b"\xff\xfe",
        2000 * b"[",
    ],
    ids=lambda body: repr(body[:20]),
)
def test_a_bad_command_is_refused(robot, body):
    """A bad body must not reach the wheels, and must not count as a sign of life."""
    with pytest.raises(BadRequestError, match=r"^omnidrive: .* send \[vx, vy, omega\]$"):
        routes(robot, CLOCK)[DRIVE](body)

    assert robot.truth().commands == 0


@pytest.mark.parametrize("method", ["PUT", "POST"])
def test_both_methods_command_the_robot(robot, method):
    """Public clients use either method."""
    assert routes(robot, CLOCK)[method, "/data/omnidrive"](b"[0.1, 0, 0]") is None

    assert robot.truth().commands == 1


def test_the_charger_can_be_connected(robot):
    """A test can then check that a program does not drive while the robot is connected to its charger."""
    table = routes(robot, CLOCK)
    power = table["GET", "/data/powermanagement"]
    assert power(b"")["ext_power"] is False

    table["POST", "/mock/charger"](b'{"connected": true}')

    assert power(b"")["ext_power"] is True


@pytest.mark.parametrize("body", [b"true", b'{"connected": 1}', b"{}"])
def test_a_bad_charger_is_refused(robot, body):
    """The message must show a valid body, so that a person can correct the request."""
    with pytest.raises(BadRequestError, match=r'send \{"connected": true\} or false$'):
        routes(robot, CLOCK)["POST", "/mock/charger"](body)


def test_a_place_in_an_obstacle_is_refused(robot):
    """The response must report the refusal, because the robot did not move."""
    with pytest.raises(BadRequestError, match=r"^place: x 2, y 0: an obstacle is there"):
        routes(robot, CLOCK)["POST", "/mock/place"](b"[2, 0, 0]")


def test_a_robot_without_laser_has_an_empty_scan(robot):
    """A real robot answers with an empty body instead of 404."""
    assert routes(robot, CLOCK)["GET", "/data/scan0"](b"") is None


def test_delays_are_robot_time():
    """At ten times the speed, a delay of 50 ms takes 5 ms."""
    network = PoorNetwork(CLOCK, 50.0, 0.0, Random(0))

    assert network.wait_s("/data/bumper") == pytest.approx(0.005)


def test_a_share_of_the_responses_is_late():
    """A test can then check that a client has a timeout and continues after it."""
    network = PoorNetwork(CLOCK, 0.0, 0.1, Random(0))
    waits = [network.wait_s("/data/bumper") for _ in range(1000)]

    assert set(waits) == {0.0, 0.1}
    assert 70 < sum(wait > 0.0 for wait in waits) < 130


def test_the_routes_of_the_mock_have_no_delay():
    """A test that reads the truth must not suffer from the network that it tests."""
    assert PoorNetwork(CLOCK, 50.0, 1.0, Random(0)).wait_s("/mock/truth") == 0.0
