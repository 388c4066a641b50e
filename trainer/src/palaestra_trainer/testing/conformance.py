"""Check an implementation of a robot or a scene against the rules of its interfaces.

A fake, a simulated and a real robot of the same class pass the same checks, so an environment works with each
of them. Each rule is a constant; its sentence is also the error message for a robot that breaks the rule. The
checks move the robot, so the robot needs half a meter of free floor on every side.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from contextlib import suppress
from typing import Any

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import NoSuchSensor, TrainerError
from palaestra_trainer.robots.base import RobotAbc, Scene
from palaestra_trainer.robots.capabilities import (
    Bumper,
    Cameras,
    Distances,
    Forklift,
    Gripper,
    Joints,
    Localization,
    Omnidrive,
    Scanner,
    Steering,
)
from palaestra_trainer.robots.geometry import Movement, Pose, Twist

PERIOD_IS_POSITIVE = "period_s is a positive number of seconds and does not change"
ADVANCE_COUNTS = "advance() returns how many extra periods passed, an int not below 0"
READINGS_STAND_STILL = "readings change in advance() only"
DISTANCES_HAVE_SHAPE = "distances() returns float32 of shape (sensors,), one for each of bearings_rad"
DISTANCES_ARE_METRES = "distances() lie in distance_range_m"
DISTANCES_ARE_OWN = "distances() returns an array that the caller may change"
BUMPED_IS_BOOL = "bumped() returns a bool"
POSE_IS_FINITE = "pose() is finite, with a heading in (-pi, pi]"
LIMITS_ARE_POSITIVE = "radius_m, speed_m_s and turn_rad_s are positive"
STEERING_MOVES = "steer() moves the robot forward or turns it, at about its speed"
MOVEMENTS_MOVE = "each Movement moves the robot along its own axis, at about its speed"
STOP_STOPS = "after two periods of STOP the robot stands"
COLORS_ARE_TYPED = "color_image() returns uint8 of shape (height, width, 3)"
DEPTHS_ARE_TYPED = "depth_image() returns float32 of shape (height, width), no meters below 0"
SCANS_ARE_TYPED = "scan() returns float32 of shape (rays,) in scan_range_m"
JOINTS_ARE_TYPED = "joints() returns finite float64 of shape (sensors,)"
MOTORS_ARE_NAMED = "motors has a name and greatest a positive number for each motor"
RESET_PLACES = "Scene.reset() leaves the robot at rest at the start, with fresh readings"
RESET_DECIDES = "the same seed, start and commands give the same readings"

PERIODS = 3  # number of periods of each movement; in this time, the acceleration becomes unimportant
STILL_M = 0.002  # tolerance for the measured motion of a standing robot, because odometry has steps
RESET_M = 0.01  # tolerance, because a robot in a simulator settles on its wheels
SHARE = 0.5  # share of the robot's greatest speeds with which steering is checked


class NotConforming(TrainerError, AssertionError):
    """A robot breaks a rule of the interface."""


def check_robot(robot: RobotAbc) -> None:
    """Check a robot that stands on free floor against the rules for robots and for its capabilities.

    Raises:
        NotConforming: a rule is broken; the message has the rule and the observed value.
    """
    _check_time(robot)
    for capability, check in _CHECKS:
        if isinstance(robot, capability):
            check(robot)
    _check_readings_stand_still(robot)


def check_scene(robot: Any, scene: Scene, start: Pose, target: tuple[float, float]) -> None:
    """Check a simulated robot and its scene against the rules about resets.

    Args:
        robot: the robot in the scene, with `Steering` and `Localization`.
        scene: the scene to check.
        start: a pose with half a meter of free floor on every side.
        target: x, y in meters of another free position.

    Raises:
        NotConforming: a rule is broken; the message has the rule and the observed value.
    """
    first = _drive_after_reset(robot, scene, start, target)
    second = _drive_after_reset(robot, scene, start, target)
    for one, other in zip(first, second, strict=True):
        _require(np.array_equal(one, other), RESET_DECIDES, (one, other))


def _check_time(robot: RobotAbc) -> None:
    extra = robot.advance()
    _require(type(extra) is int and extra >= 0, ADVANCE_COUNTS, extra)
    _require(0.0 < robot.period_s == robot.period_s, PERIOD_IS_POSITIVE, robot.period_s)


def _check_distances(robot: Distances) -> None:
    distances = robot.distances()
    _require(
        distances.shape == (len(robot.bearings_rad),) and distances.dtype == np.float32,
        DISTANCES_HAVE_SHAPE,
        (distances.shape, distances.dtype),
    )
    least, most = np.array(robot.distance_range_m, np.float32)
    _require(bool(((distances >= least) & (distances <= most)).all()), DISTANCES_ARE_METRES, distances)
    distances.fill(np.nan)
    _require(not np.isnan(robot.distances()).any(), DISTANCES_ARE_OWN, robot.distances())


def _check_bumper(robot: Bumper) -> None:
    _require(type(robot.bumped()) is bool, BUMPED_IS_BOOL, robot.bumped())


def _check_pose(robot: Localization) -> None:
    pose = robot.pose()
    _require(math.isfinite(pose.x_m + pose.y_m), POSE_IS_FINITE, pose)
    _require(-math.pi < pose.heading_rad <= math.pi, POSE_IS_FINITE, pose)


def _check_steering(robot: Any) -> None:
    limits = robot.radius_m, robot.speed_m_s, robot.turn_rad_s
    _require(min(limits) > 0.0, LIMITS_ARE_POSITIVE, limits)
    if not _knows_where_it_is(robot):
        return
    for forward, turn in ((robot.speed_m_s, 0.0), (-robot.speed_m_s, 0.0), (0.0, robot.turn_rad_s)):
        wanted = (SHARE * forward, 0.0, SHARE * turn)
        _check_motion(robot, lambda twist: robot.steer(twist[0], twist[2]), wanted, STEERING_MOVES)


def _check_movements(robot: Any) -> None:
    if _knows_where_it_is(robot):
        for movement in Movement:
            _check_motion(robot, lambda twist: robot.drive(*twist), movement.twist, MOVEMENTS_MOVE)


def _knows_where_it_is(robot: object) -> bool:
    return isinstance(robot, Localization)


def _check_motion(robot: Any, drive: Callable[[Twist], None], wanted: Twist, rule: str) -> None:
    """Compare the motion of the robot with the commanded motion, then stop the robot."""
    before = robot.pose()
    drive(wanted)
    elapsed_s = sum(robot.period_s * (1 + robot.advance()) for _ in range(PERIODS))
    driven = moved(before, robot.pose())
    for asked, got in zip(wanted, driven, strict=True):
        ideal = asked * elapsed_s
        slack = 0.5 * abs(ideal) if asked else 0.05
        _require(abs(got - ideal) <= slack, rule, (wanted, driven))
    drive((0.0, 0.0, 0.0))
    robot.advance()
    robot.advance()
    stopped = robot.pose()
    robot.advance()
    drift = moved(stopped, robot.pose())
    _require(max(map(abs, drift)) <= STILL_M, STOP_STOPS, (wanted, drift))


def _check_images(robot: Any) -> None:
    """Check the images of the cameras that the robot has."""
    with suppress(NoSuchSensor):
        robot.use_cameras(color=True)
        robot.advance()
        image = robot.color_image()
        typed = image.shape[2:] == (3,) and image.dtype == np.uint8
        _require(typed, COLORS_ARE_TYPED, (image.shape, image.dtype))
    with suppress(NoSuchSensor):
        robot.use_cameras(depth=True)
        robot.advance()
        depths = robot.depth_image()
        typed = len(depths.shape[1:]) == 1 and depths.dtype == np.float32
        _require(typed and bool((depths >= 0.0).all()), DEPTHS_ARE_TYPED, (depths.shape, depths.dtype))


def _check_scan(robot: Any) -> None:
    with suppress(NoSuchSensor):
        robot.use_scanner()
        robot.advance()
        scan = robot.scan()
        least, most = np.array(robot.scan_range_m, np.float32)
        _require(scan.ndim == 1 and scan.dtype == np.float32, SCANS_ARE_TYPED, (scan.shape, scan.dtype))
        _require(bool(((scan >= least) & (scan <= most)).all()), SCANS_ARE_TYPED, scan)


def _check_joints(robot: Joints) -> None:
    one_each = len(robot.greatest) == len(robot.motors) > 0 and min(robot.greatest) > 0.0
    _require(one_each, MOTORS_ARE_NAMED, (robot.motors, robot.greatest))
    robot.command([0.0] * len(robot.motors))
    joints = robot.joints()
    typed = joints.shape == (len(robot.sensors),) and joints.dtype == np.float64
    _require(typed and bool(np.isfinite(joints).all()), JOINTS_ARE_TYPED, joints)


def _check_gripper(robot: Any) -> None:
    with suppress(NoSuchSensor):
        robot.use_gripper()
        robot.grip(1.0)
        robot.advance()
        robot.grip(0.0)


def _check_fork(robot: Any) -> None:
    with suppress(NoSuchSensor):
        robot.use_forklift()
        robot.lift(robot.lift_range_m[1])
        robot.advance()
        robot.lift(robot.lift_range_m[0])


_CHECKS: tuple[tuple[type, Callable[[Any], None]], ...] = (
    (Distances, _check_distances),
    (Bumper, _check_bumper),
    (Localization, _check_pose),
    (Omnidrive, _check_movements),
    (Steering, _check_steering),
    (Cameras, _check_images),
    (Scanner, _check_scan),
    (Joints, _check_joints),
    (Gripper, _check_gripper),
    (Forklift, _check_fork),
)


def _check_readings_stand_still(robot: RobotAbc) -> None:
    before = _readings(robot)
    if isinstance(robot, Steering):
        robot.steer(robot.speed_m_s, 0.0)
    after = _readings(robot)
    if isinstance(robot, Steering):
        robot.steer(0.0, 0.0)
    _require(before == after, READINGS_STAND_STILL, (before, after))


def _readings(robot: object) -> list[Any]:
    """Return the readings of the robot as a list, without the readings of optional devices."""
    return [
        *(robot.distances().tolist() if isinstance(robot, Distances) else ()),
        *(robot.joints().tolist() if isinstance(robot, Joints) else ()),
        *([robot.bumped()] if isinstance(robot, Bumper) else ()),
        *([robot.pose()] if isinstance(robot, Localization) else ()),
    ]


def _drive_after_reset(
    robot: Any, scene: Scene, start: Pose, target: tuple[float, float]
) -> list[NDArray[np.float64]]:
    """Reset the scene and drive a short distance; return the readings."""
    scene.reset(7, start, target)
    off = moved(start, robot.pose())
    _require(max(map(abs, off)) <= RESET_M and not _feels_contact(robot), RESET_PLACES, robot.pose())
    readings = [_numbers(robot)]
    robot.steer(0.5 * robot.speed_m_s, 0.5 * robot.turn_rad_s)
    for _ in range(PERIODS):
        robot.advance()
        readings.append(_numbers(robot))
    robot.steer(0.0, 0.0)
    return readings


def _feels_contact(robot: object) -> bool:
    return isinstance(robot, Bumper) and robot.bumped()


def _numbers(robot: Any) -> NDArray[np.float64]:
    pose = robot.pose()
    distances = robot.distances() if isinstance(robot, Distances) else ()
    return np.array([pose.x_m, pose.y_m, pose.heading_rad, *distances])


def moved(before: Pose, after: Pose) -> Twist:
    """Return the motion between two poses in the frame of the first: meters forward and left, radians."""
    dx, dy = after.x_m - before.x_m, after.y_m - before.y_m
    c, s = math.cos(before.heading_rad), math.sin(before.heading_rad)
    turned_rad = math.remainder(after.heading_rad - before.heading_rad, 2.0 * math.pi)
    return dx * c + dy * s, dy * c - dx * s, turned_rad


def _require(holds: bool, rule: str, seen: object) -> None:  # noqa: FBT001 - as `assert` takes it
    if not holds:
        raise NotConforming(f"{rule}; seen: {seen}")
