"""The contents of messages as plain dicts, with every field of their types.

Lengths are in meters, angles in radians counter-clockwise, times in seconds. A pose is x, y and heading; a
velocity is forward, left and turn. The axes are those of REP 103: x forward, y to the left, z up.
Source: https://www.ros.org/reps/rep-0103.html
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import ConfigurationError

Content = dict[str, Any]
Pose = tuple[float, float, float]  # x in m, y in m, heading in rad
Velocity = tuple[float, float, float]  # forward in m/s, to the left in m/s, turn in rad/s

BASE = "base_link"  # Source of BASE, ODOM and MAP: https://www.ros.org/reps/rep-0105.html
ODOM = "odom"
MAP = "map"
CAMERA = "camera"
_NS = 1_000_000_000
_LATEST_S = 2**31  # builtin_interfaces/Time counts seconds in 31 bits and a sign
_COVARIANCE = [0.0] * 36
# Source: sensor_msgs/Imu, which writes -1 first into a covariance if the quantity was not measured.
_NOT_MEASURED = [-1.0, *[0.0] * 35]


def nanoseconds(stamp_s: float) -> int:
    """Return a time in whole nanoseconds.

    Raises:
        ConfigurationError: the time is not finite, below 0, or after the year 2038.
    """
    if not 0.0 <= stamp_s < _LATEST_S:
        raise ConfigurationError(f"stamp: {stamp_s} s is not a time of ROS 2; give 0 to {_LATEST_S - 1} s")
    whole_s = int(stamp_s)  # the float stamp_s * _NS would be rounded to a quarter of a microsecond
    return whole_s * _NS + round((stamp_s - whole_s) * _NS)


def odometry(stamp_s: float, pose: Pose, velocity: Velocity | None, frame: str = ODOM) -> Content:
    """Return an Odometry with the pose of `base_link` in `frame`, and its velocity in `base_link`.

    All covariances are 0, which means unknown. If `velocity` is None, the velocity is 0 and the first number
    of its covariance is -1.
    """
    return {
        "header": header(stamp_s, frame),
        "child_frame_id": BASE,
        "pose": {"pose": _pose(pose), "covariance": _COVARIANCE},
        "twist": {
            "twist": twist(velocity or (0.0, 0.0, 0.0)),
            "covariance": _NOT_MEASURED if velocity is None else _COVARIANCE,
        },
    }


def twist(velocity: Velocity) -> Content:
    """Return a Twist, such as a command for `/cmd_vel`."""
    forward, left, turn = velocity
    return {"linear": _vector(forward, left, 0.0), "angular": _vector(0.0, 0.0, turn)}


def ranges(stamp_s: float, distances_m: Sequence[float], within_m: tuple[float, float]) -> Content:
    """Return a LaserScan of distance sensors all around a robot, the first forward, counter-clockwise.

    The nine infrared sensors of a Robotino are 40 degrees apart. Outside its range, such a sensor returns the
    nearer bound. So the message has infinity for a distance at or above the upper bound, and minus infinity
    for one at or below the lower bound. Source: https://www.ros.org/reps/rep-0117.html

    Args:
        stamp_s: the time of the reading.
        distances_m: at least one distance; NaN stands for a wrong reading.
        within_m: the smallest and the greatest distance that the sensors measure.
    """
    low, high = within_m
    step = 2.0 * math.pi / len(distances_m)
    return {
        "header": header(stamp_s, BASE),
        "angle_min": 0.0,
        "angle_max": step * (len(distances_m) - 1),
        "angle_increment": step,
        "time_increment": 0.0,
        "scan_time": 0.0,
        "range_min": low,
        "range_max": high,
        "ranges": [_range(distance, low, high) for distance in distances_m],
        "intensities": [],
    }


def image(stamp_s: float, pixels: NDArray[np.uint8]) -> Content:
    """Return an Image of the frame `camera` with RGB pixels, shape (height, width, 3)."""
    height, width, colors = pixels.shape
    return {
        "header": header(stamp_s, CAMERA),
        "height": height,
        "width": width,
        "encoding": "rgb8",
        "is_bigendian": 0,
        "step": colors * width,
        "data": pixels.tobytes(),
    }


def bump(*, touched: bool) -> Content:
    """Return a Bool: whether the bumper is pressed."""
    return {"data": touched}


def numbers(values: Sequence[float], label: str) -> Content:
    """Return a Float32MultiArray of one dimension, such as an observation or an action of a policy."""
    size = len(values)
    dimension = {"label": label, "size": size, "stride": size}
    return {"layout": {"dim": [dimension], "data_offset": 0}, "data": [float(value) for value in values]}


def target(stamp_s: float, x_m: float, y_m: float, frame: str = ODOM) -> Content:
    """Return a PoseStamped of a target, which has no heading: its orientation is the frame's."""
    return {"header": header(stamp_s, frame), "pose": _pose((x_m, y_m, 0.0))}


def transform(stamp_s: float, pose: Pose, frame: str = ODOM) -> Content:
    """Return a TFMessage with the transform from `frame` to `base_link`."""
    x_m, y_m, heading = pose
    stamped = {
        "header": header(stamp_s, frame),
        "child_frame_id": BASE,
        "transform": {"translation": _vector(x_m, y_m, 0.0), "rotation": _quaternion(heading)},
    }
    return {"transforms": [stamped]}


def record(fields: Mapping[str, object]) -> Content:
    """Return a String with a JSON object, such as a decision and its reason.

    Raises:
        ValueError: a number is not finite.
        TypeError: JSON has no such value.
    """
    return {"data": json.dumps(dict(fields), separators=(",", ":"), allow_nan=False)}


def header(stamp_s: float, frame: str) -> Content:
    """Return a Header."""
    sec, nanosec = divmod(nanoseconds(stamp_s), _NS)
    return {"stamp": {"sec": sec, "nanosec": nanosec}, "frame_id": frame}


def _pose(pose: Pose) -> Content:
    x_m, y_m, heading = pose
    return {"position": _vector(x_m, y_m, 0.0), "orientation": _quaternion(heading)}


def _vector(x: float, y: float, z: float) -> Content:
    return {"x": x, "y": y, "z": z}


def _quaternion(heading_rad: float) -> Content:
    return {"x": 0.0, "y": 0.0, "z": math.sin(heading_rad / 2.0), "w": math.cos(heading_rad / 2.0)}


def _range(distance_m: float, low: float, high: float) -> float:
    if distance_m >= high:
        return math.inf
    return -math.inf if distance_m <= low else distance_m
