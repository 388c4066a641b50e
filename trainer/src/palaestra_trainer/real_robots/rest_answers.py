"""The responses of a Robotino's REST interface, as readings.

Source: wiki.openrobotino.org/Rest_api.html, and the field names that public clients read. The responses are
data of another program, so each is checked before it is used.
"""

from __future__ import annotations

import json
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import LinkError
from palaestra_trainer.real_robots.frames import wrapped
from palaestra_trainer.real_robots.readings import Odometry
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.robots.base import SENSORS
from palaestra_trainer.robots.geometry import Pose

MOST_BYTES: Final = 65_536  # the longest response, that of a laser scanner, has about 10,000 bytes

_MOST: Final = 1e12  # the count of measurements reaches this after thousands of years
_ODOMETRY: Final = 7  # x, y, rotation, vx, vy, omega, number


def odometry_of(body: bytes) -> tuple[float, Odometry]:
    """Return the number of a measurement and the odometry in a response to /data/odometry.

    Raises:
        LinkError: the response is not odometry.
    """
    x_m, y_m, heading, *velocity, number = _numbers("odometry", body, _ODOMETRY)
    return number, Odometry(Pose(x_m, y_m, wrapped(heading)), (velocity[0], velocity[1], velocity[2]))


def distances_of(body: bytes, layout: SensorLayout) -> NDArray[np.float32]:
    """Return the distances in a response to /data/distancesensorarray, converted by `layout`.

    Raises:
        LinkError: the response is not nine numbers.
    """
    return layout.meters_of(_numbers("distancesensorarray", body, SENSORS))


def bumped_of(body: bytes) -> bool:
    """Return the state in a response to /data/bumper.

    Raises:
        LinkError: the response has no state.
    """
    match _json("bumper", body):
        case {"value": bool(bumped)}:
            return bumped
        case other:
            raise _unreadable("bumper", other)


def charges(body: bytes) -> bool:
    """Return whether a response to /data/powermanagement reports external power.

    Raises:
        LinkError: the response does not report the power.
    """
    match _json("powermanagement", body):
        case {"ext_power": bool() | int() as external}:
            return bool(external)
        case other:
            raise _unreadable("powermanagement", other)


def _numbers(route: str, body: bytes, count: int) -> list[float]:
    """Return the finite numbers of a JSON array."""
    values = _json(route, body)
    if not isinstance(values, list) or len(values) != count or not all(map(_is_finite, values)):
        raise _unreadable(route, values)
    return [float(value) for value in values]


def _is_finite(value: Any) -> bool:
    """Return whether a value is a number that a robot may report."""
    return isinstance(value, int | float) and not isinstance(value, bool) and -_MOST <= value <= _MOST


def _json(route: str, body: bytes) -> Any:
    try:
        return json.loads(body)
    except (ValueError, RecursionError):
        raise _unreadable(route, body[:80]) from None


def _unreadable(route: str, found: object) -> LinkError:
    return LinkError(f"/data/{route}: returned {str(found)[:80]!r}, which a Robotino does not send")
