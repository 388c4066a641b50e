"""The mock robot as a program, with a client of http.client: one connection for many requests."""

import signal
import socket
import sys

import pytest

from tests.mock_robots import DEADLINE_S, PROGRAM, ended, settled, started
from tests.waiting import eventually

SCRIPT = """
import subprocess, sys
robot = subprocess.Popen(sys.argv[1:], stdout=subprocess.PIPE)
sys.stdout.write(robot.stdout.readline().decode())
"""


@pytest.fixture(scope="module")
def running():
    """Yield a client of a robot with a perfect odometry, which all tests of this file share."""
    process, client = started("--speed=2", "--drift=0")
    yield client
    ended(process, client)


@pytest.fixture
def robot(running):
    """Return the client of a robot that stands in the middle of the arena."""
    return settled(running)


def test_the_odometry_advances_under_commands(robot):
    """A program that sends often enough must drive."""
    x, y, *_, seq = robot.get("/data/odometry?sid=test")
    ends = robot.get("/mock/truth")["time_s"] + 1.0
    while robot.get("/mock/truth")["time_s"] < ends:
        robot.send("/data/omnidrive?sid=test", [0.2, 0.0, 0.0])

    truth, after = robot.get("/mock/truth"), robot.get("/data/odometry")
    way = ((after[0] - x) ** 2 + (after[1] - y) ** 2) ** 0.5
    assert truth["x"] > 0.1
    assert way == pytest.approx(truth["x"], abs=0.05)
    assert after[6] > seq + 25


def test_the_dead_mans_switch_stops_the_robot(robot):
    """After one command, the robot drives for 200 ms of its own time, at any load of the machine."""
    robot.send("/data/omnidrive", [0.5, 0.0, 0.0])
    sent = robot.get("/mock/truth")["last_command_s"]
    at_rest = eventually(lambda: at_rest_after(robot, sent + 0.3), pace_s=0.005)

    assert 0.07 < at_rest["x"] < 0.17


def at_rest_after(robot, time_s):
    """Return the truth if it is later than a time and the robot stands; else None."""
    truth = robot.get("/mock/truth")
    return truth if truth["time_s"] > time_s and truth["vx"] == 0.0 else None


def test_carrying_the_robot_does_not_change_its_odometry(robot):
    """Odometry counts the turns of the wheels, so a program cannot notice that a person carried the robot."""
    before = robot.get("/data/odometry")[:3]
    robot.send("/mock/place", [0.0, 1.0, 1.5])

    truth = robot.get("/mock/truth")
    assert (truth["x"], truth["y"], truth["heading"]) == (0.0, 1.0, 1.5)
    assert robot.get("/data/odometry")[:3] == before


def test_a_wall_presses_the_bumper(robot):
    """If the distance sensors do not stop a program before a wall, only the bumper still can."""
    robot.send("/mock/place", [1.7, 0.0, 0.0])
    contacts = robot.get("/mock/truth")["contacts"]
    assert robot.get("/data/bumper") == {"value": False}
    assert robot.get("/data/distancesensorarray")[0] < 0.15

    robot.send("/data/omnidrive", [1.0, 0.0, 0.0])
    eventually(lambda: robot.get("/data/bumper")["value"], pace_s=0.005)

    assert robot.get("/mock/truth")["contacts"] == contacts + 1


@pytest.mark.parametrize(
    ("method", "path", "body", "status"),
    [
        ("PUT", "/data/omnidrive", "[1, 2]", 400),
        ("POST", "/data/omnidrive", "stop", 400),
        ("POST", "/mock/place", "[2, 0, 0]", 400),
        ("GET", "/data/omnidrive", None, 405),
        ("GET", "/data/pose", None, 404),
        ("PUT", "/data/omnidrive", 5000 * " ", 413),
    ],
    ids=["two numbers", "no JSON", "obstacle", "method", "path", "length"],
)
def test_a_wrong_request_is_refused(robot, method, path, body, status):
    """A refusal must contain its reason, and the robot must still respond to the program's next request."""
    found, content = robot.ask(method, path, body)

    assert found == status
    assert ": " in content["error"]
    assert robot.ask("GET", "/data/imageversion") == (200, {"version": "4.20.9"})


def test_a_body_without_a_length_is_refused(robot):
    """The server must not guess where the next request begins."""
    with socket.create_connection(robot.address.split(":"), DEADLINE_S) as raw:
        raw.sendall(b"PUT /data/omnidrive HTTP/1.1\r\nHost: robot\r\n\r\n[1, 0, 0]")

        assert raw.makefile("rb").readline() == b"HTTP/1.1 411 Length Required\r\n"


def test_a_connection_may_break_in_a_request(robot):
    """A killed program may leave half a request behind, and the robot must not execute it."""
    commands = robot.get("/mock/truth")["commands"]
    with socket.create_connection(robot.address.split(":"), DEADLINE_S) as raw:
        raw.sendall(b"PUT /data/omnidrive HTTP/1.1\r\nContent-Length: 90\r\n\r\n[1, 0, 0]")
        raw.shutdown(socket.SHUT_WR)

        assert raw.recv(100) == b""
    assert robot.get("/mock/truth")["commands"] == commands


def test_one_connection_serves_many_requests(robot):
    """Programs keep one connection, because a new one costs a round trip."""
    local = robot.connection.sock.getsockname()
    for _ in range(50):
        robot.get("/data/odometry")

    assert robot.connection.sock.getsockname() == local


def test_the_network_delays_and_loses_responses():
    """A program must survive a bad network, which the mock imitates on request; /mock/truth has no delay."""
    process, client = started("--timeouts=1", "--start=-1,0,0", "--charging")
    client.connection.timeout = 0.05
    with pytest.raises(TimeoutError):
        client.send("/data/omnidrive", [0.1, 0.0, 0.0])
    client.connection.close()

    client.connection.timeout = DEADLINE_S
    eventually(lambda: client.get("/mock/truth")["commands"] == 1, pace_s=0.005)
    ended(process, client)


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_the_program(number):
    """An open connection, and a response that is due later, must not keep the program alive."""
    process, client = started("--delay-ms=60000")
    client.connection.request("GET", "/data/odometry")
    process.send_signal(number)

    assert process.wait(DEADLINE_S) == 0
    ended(process, client)


def test_the_robot_ends_with_its_parent():
    """A script that fails must not leave a robot on the port."""
    script, client = started(program=(sys.executable, "-c", SCRIPT, *PROGRAM))
    assert script.wait(DEADLINE_S) == 0
    script.communicate()

    eventually(lambda: not listens(client.address), pace_s=0.02)


def listens(address):
    """Return whether a program listens on an address."""
    try:
        socket.create_connection(address.split(":"), DEADLINE_S).close()
    except ConnectionError:  # a server that is closing resets a connection that it has not accepted yet
        return False
    return True
