"""The definition of "a Robotino", as checks for any implementation.

The fake, the simulated and the real robot pass the same checks, so an environment
can be moved from one to the other. Each rule is a constant: the sentence in the
error of a robot that fails it. Each check drives, so give the robot half a meter of
free floor on every side.
"""

from __future__ import annotations

import math
from contextlib import suppress

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import NoSuchSensor, TrainerError
from palaestra_trainer.robots.base import (
    SENSOR_RANGE_M,
    SENSORS,
    Movement,
    Pose,
    RobotinoAbc,
    Scene,
    Twist,
)

PERIOD_IS_POSITIVE = "period_s is a positive number of seconds and does not change"
DISTANCES_HAVE_SHAPE = "distances() returns float32 of shape (9,)"
DISTANCES_ARE_METRES = "distances() lie in SENSOR_RANGE_M"
DISTANCES_ARE_OWN = "distances() returns an array that the caller may change"
BUMPED_IS_BOOL = "bumped() returns a bool"
POSE_IS_FINITE = "pose() is finite, with a heading in (-pi, pi]"
READINGS_STAND_STILL = "readings change in advance() only"
ADVANCE_COUNTS = "advance() returns how many extra periods passed, an int not below 0"
MOVEMENTS_MOVE = "each Movement moves the robot along its own axis, at about its speed"
STOP_STOPS = "after two periods of STOP the robot stands"
COLORS_ARE_TYPED = "color_image() returns uint8 of shape (height, width, 3)"
DEPTHS_ARE_TYPED = "depth_image() returns float32 of shape (height, width), no meters below 0"
RESET_PLACES = "Scene.reset() leaves the robot at rest at the start, with fresh readings"
RESET_DECIDES = "the same seed, start and commands give the same readings"

PERIODS = 3  # of each movement: enough for the constant speed to outweigh the acceleration
STILL_M = 0.002  # apparent motion of a standing robot: odometry has steps
RESET_M = 0.01  # a simulator may let the robot settle on its wheels


class NotConforming(TrainerError, AssertionError):
    """A robot broke one of the rules."""


def check_robot(robot: RobotinoAbc) -> None:
    """Check a robot, standing on free floor, against every rule that needs no scene.

    Raises:
        NotConforming: with the broken rule and the observed value.
    """
    _check_readings(robot)
    _check_standing_still(robot)
    for movement in Movement:
        _check_movement(robot, movement)
    _check_images(robot)


def check_scene(robot: RobotinoAbc, scene: Scene, start: Pose, target: tuple[float, float]) -> None:
    """Check a simulated robot and its scene against the rules about resets.

    Args:
        robot: the robot in the scene.
        scene: the scene to check.
        start: a pose with half a meter of free floor on every side.
        target: x, y in meters of another free place.

    Raises:
        NotConforming: with the broken rule and the observed value.
    """
    first = _drive_after_reset(robot, scene, start, target)
    second = _drive_after_reset(robot, scene, start, target)
    for one, other in zip(first, second, strict=True):
        _require(np.array_equal(one, other), RESET_DECIDES, (one, other))


def _check_readings(robot: RobotinoAbc) -> None:
    extra = robot.advance()
    distances = robot.distances()
    pose = robot.pose()
    _require(type(extra) is int and extra >= 0, ADVANCE_COUNTS, extra)
    _require(0.0 < robot.period_s == robot.period_s, PERIOD_IS_POSITIVE, robot.period_s)
    _require(
        distances.shape == (SENSORS,) and distances.dtype == np.float32,
        DISTANCES_HAVE_SHAPE,
        (distances.shape, distances.dtype),
    )
    least, most = np.array(SENSOR_RANGE_M, np.float32)
    _require(bool(((distances >= least) & (distances <= most)).all()), DISTANCES_ARE_METRES, distances)
    _require(type(robot.bumped()) is bool, BUMPED_IS_BOOL, robot.bumped())
    _require(math.isfinite(pose.x_m + pose.y_m), POSE_IS_FINITE, pose)
    _require(-math.pi < pose.heading_rad <= math.pi, POSE_IS_FINITE, pose)


def _check_standing_still(robot: RobotinoAbc) -> None:
    before = robot.distances(), robot.pose()
    robot.distances().fill(np.nan)
    _require(not np.isnan(robot.distances()).any(), DISTANCES_ARE_OWN, robot.distances())
    robot.move(Movement.FORWARD)
    after = robot.distances(), robot.pose()
    robot.move(Movement.STOP)
    same = np.array_equal(before[0], after[0]) and before[1] == after[1]
    _require(same, READINGS_STAND_STILL, (before, after))


def _check_movement(robot: RobotinoAbc, movement: Movement) -> None:
    before = robot.pose()
    robot.move(movement)
    elapsed_s = sum(robot.period_s * (1 + robot.advance()) for _ in range(PERIODS))
    _check_twist(movement, moved(before, robot.pose()), elapsed_s)
    robot.move(Movement.STOP)
    robot.advance()
    robot.advance()
    stopped = robot.pose()
    robot.advance()
    drift = moved(stopped, robot.pose())
    _require(max(map(abs, drift)) <= STILL_M, STOP_STOPS, (movement, drift))


def _check_twist(movement: Movement, seen: Twist, elapsed_s: float) -> None:
    """Compare the driven distance (m, m, rad) with the commanded one."""
    for asked, driven in zip(movement.twist, seen, strict=True):
        ideal = asked * elapsed_s
        slack = 0.5 * abs(ideal) if asked else 0.05
        _require(abs(driven - ideal) <= slack, MOVEMENTS_MOVE, (movement, seen))


def _check_images(robot: RobotinoAbc) -> None:
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


def _drive_after_reset(
    robot: RobotinoAbc, scene: Scene, start: Pose, target: tuple[float, float]
) -> list[NDArray[np.float32]]:
    """Return the readings of a short drive that begins with a reset."""
    scene.reset(7, start, target)
    off = moved(start, robot.pose())
    _require(max(map(abs, off)) <= RESET_M and not robot.bumped(), RESET_PLACES, robot.pose())
    readings = [robot.distances()]
    robot.move(Movement.LEFT)
    for _ in range(PERIODS):
        robot.advance()
        readings.append(robot.distances())
    robot.move(Movement.STOP)
    return readings


def moved(before: Pose, after: Pose) -> Twist:
    """Return how far a robot moved: meters forward and left of its first pose, radians turned."""
    dx, dy = after.x_m - before.x_m, after.y_m - before.y_m
    c, s = math.cos(before.heading_rad), math.sin(before.heading_rad)
    turned_rad = math.remainder(after.heading_rad - before.heading_rad, 2.0 * math.pi)
    return dx * c + dy * s, dy * c - dx * s, turned_rad


def _require(holds: bool, rule: str, seen: object) -> None:  # noqa: FBT001 - as `assert` takes it
    if not holds:
        raise NotConforming(f"{rule}; seen: {seen}")
