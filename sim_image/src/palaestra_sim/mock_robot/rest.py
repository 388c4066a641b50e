"""The routes of a Robotino's REST interface, and the routes of the mock for tests and people.

The routes below `/data` are those of a Robotino without a laser scanner and without authentication. Source:
wiki.openrobotino.org, Rest_api. Values that public documents do not state, such as the voltage, are examples.

| method, path | content |
|---|---|
| GET /data/odometry | `[x, y, rot, vx, vy, omega, seq]` |
| GET /data/bumper | `{"value": bool}` |
| GET /data/distancesensorarray | nine distances in meters, counter-clockwise from the front |
| GET /data/powermanagement | battery and charger |
| GET /data/imageversion, /data/controllerinfo | versions |
| GET /cam0 | the test picture of `camera`, as a JPEG file |
| GET /data/festoolcharger, /data/scan0 | empty |
| PUT or POST /data/omnidrive | takes `[vx, vy, omega]` in m/s and rad/s |
| GET /mock/truth | the fields of `Truth` |
| POST /mock/place | takes `[x, y, heading]` in m and rad: a person carries the robot |
| POST /mock/charger | takes `{"connected": bool}` |

A command takes effect when it arrives, also if its response is delayed or lost.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from random import Random
from typing import Any, Final

from palaestra_sim.mock_robot.camera import picture
from palaestra_sim.mock_robot.pace import Clock
from palaestra_sim.mock_robot.robot import MockRobot, MockRobotError
from palaestra_sim.mock_robot.server import BadRequestError, Routes
from palaestra_sim.ros_interfaces import UnsimulatedError

TIMEOUT_S: Final = 1.0
"""The delay of a lost response, in robot time; clients of a Robotino have timeouts of 0.1 to 0.2 s."""
_IMAGE_VERSION: Final = {"version": "4.20.9"}
_CONTROLLER: Final = {"TYPE": "controllerinfo", "payload": {"hardware": "3.0.0", "software": "1.2.3"}}
_THREE: Final = 3


class PoorNetwork:
    """The delays of a network; they apply to the routes of the robot, but not to the routes of the mock.

    Args:
        clock: converts robot time to real time.
        delay_ms: the delay of every response, in milliseconds of robot time.
        timeouts: share of the requests whose responses are lost.
        random: decides which responses are lost.
    """

    def __init__(self, clock: Clock, delay_ms: float, timeouts: float, random: Random) -> None:
        self._delay_s = clock.real_s(delay_ms / 1000.0)
        self._timeout_s = clock.real_s(TIMEOUT_S)
        self._timeouts = timeouts
        self._random = random

    def wait_s(self, path: str) -> float:
        """Return the delay of the next response, in seconds of real time."""
        if path.startswith("/mock/"):
            return 0.0
        if self._timeouts and self._random.random() < self._timeouts:
            return self._timeout_s
        return self._delay_s


def routes(robot: MockRobot, clock: Clock) -> Routes:
    """Return all routes of a robot."""

    def get(read: Callable[[], Any]) -> Callable[[bytes], Any]:
        return lambda _: read()

    def drive(body: bytes) -> None:
        robot.command(_three("omnidrive", body, "[vx, vy, omega]"), clock.now_s())

    def place(body: bytes) -> None:
        try:
            robot.place(*_three("place", body, "[x, y, heading]"))
        except MockRobotError as error:
            raise BadRequestError(f"place: {error}") from None

    def charger(body: bytes) -> None:
        match _content(body):
            case {"connected": bool(connected)}:
                robot.charging = connected
            case _:
                raise BadRequestError('charger: the body is wrong; send {"connected": true} or false')

    def camera() -> bytes:
        truth = robot.truth()
        try:
            return picture(truth.x, truth.y, truth.heading)
        except UnsimulatedError as error:
            raise BadRequestError(f"cam0: {error}") from None

    return {
        ("GET", "/cam0"): get(camera),
        ("GET", "/data/odometry"): get(robot.odometry),
        ("GET", "/data/bumper"): get(lambda: {"value": robot.bumped()}),
        ("GET", "/data/distancesensorarray"): get(robot.distances_m),
        ("GET", "/data/powermanagement"): get(lambda: _power(charging=robot.charging)),
        ("GET", "/data/imageversion"): get(lambda: _IMAGE_VERSION),
        ("GET", "/data/controllerinfo"): get(lambda: _CONTROLLER),
        ("GET", "/data/festoolcharger"): get(lambda: None),
        ("GET", "/data/scan0"): get(lambda: None),
        ("PUT", "/data/omnidrive"): drive,
        ("POST", "/data/omnidrive"): drive,
        ("GET", "/mock/truth"): get(lambda: robot.truth()._asdict()),
        ("POST", "/mock/place"): place,
        ("POST", "/mock/charger"): charger,
    }


def _power(*, charging: bool) -> dict[str, Any]:
    return {
        "batteryLow": False,
        "batteryLowShutdownCounter": 0,
        "batteryType": "Pb",
        "ext_power": charging,
        "num_chargers": 1,
        "voltage": 25.2,
    }


def _three(name: str, body: bytes, shape: str) -> tuple[float, float, float]:
    """Return the three numbers of a body.

    Raises:
        BadRequestError: the body is not a list of three finite numbers.
    """
    content = _content(body)
    if isinstance(content, list) and len(content) == _THREE and all(map(_is_finite, content)):
        first, second, third = content
        return float(first), float(second), float(third)
    raise BadRequestError(f"{name}: the body is not three finite numbers; send {shape}")


def _content(body: bytes) -> Any:
    """Return the JSON content of a body; None if the body is not JSON."""
    try:
        return json.loads(body)
    except (ValueError, RecursionError):
        return None


def _is_finite(value: Any) -> bool:
    try:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # a whole number that is too large for a float
        return False
