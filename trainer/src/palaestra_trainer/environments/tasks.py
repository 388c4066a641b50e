"""The arena of the shipped world, and the tasks that are drawn in it.

It is a square floor with four cylinders. The environment needs its dimensions only
to draw free starts and targets, and to scale observations.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.base import RADIUS_M, Pose

HALF_SIDE_M = 2.0  # from the center to the inner faces of the walls
CYLINDERS = ((0.8, 0.8), (-0.8, 0.8), (-0.8, -0.8), (0.8, -0.8))
CYLINDER_NAMES = ("CYLINDER_0", "CYLINDER_1", "CYLINDER_2", "CYLINDER_3")  # DEF names in the worlds
CYLINDER_CENTER_M = 0.2  # above the floor
CYLINDER_RADIUS_M = 0.25  # wide enough not to fit between two of the robot's infrared rays
OUTLINE_M = 0.2286  # radius of the body and its bumper in the shipped world
CLEARANCE_M = 0.10  # between the robot's body and any obstacle, at the start and on the target
APART_M = 1.0  # least distance from start to target

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Task:
    """One episode's task: from `start` to `target` (x, y in meters)."""

    start: Pose
    target: Point


def gap(x_m: float, y_m: float, cylinders: Sequence[Point] = CYLINDERS) -> float:
    """Return meters from a point to the nearest wall or cylinder; negative inside one."""
    wall = HALF_SIDE_M - max(abs(x_m), abs(y_m))
    middle = min((math.hypot(x_m - x, y_m - y) for x, y in cylinders), default=math.inf)
    return min(wall, middle - CYLINDER_RADIUS_M)


def free(x_m: float, y_m: float, cylinders: Sequence[Point] = CYLINDERS) -> bool:
    """Return whether a robot at this place keeps at least `CLEARANCE_M` from every obstacle."""
    return gap(x_m, y_m, cylinders) >= RADIUS_M + CLEARANCE_M


def apart(one: Point, other: Point) -> bool:
    """Return whether two points are far enough apart to be start and target."""
    return math.dist(one, other) >= APART_M


def draw_point(random: np.random.Generator, cylinders: Sequence[Point] = CYLINDERS) -> Point:
    """Return x, y in meters of a random free place; all free places are equally likely."""
    while True:
        x_m, y_m = random.uniform(-HALF_SIDE_M, HALF_SIDE_M, size=2).tolist()
        if free(x_m, y_m, cylinders):
            return x_m, y_m


def draw_task(
    random: np.random.Generator,
    start: Pose | None = None,
    target: Point | None = None,
    cylinders: Sequence[Point] = CYLINDERS,
) -> Task:
    """Return a task with free places `APART_M` apart and a random heading; given values are kept."""
    heading_rad = float(random.uniform(-math.pi, math.pi))
    while True:
        begin = start or Pose(*draw_point(random, cylinders), heading_rad)
        end = target or draw_point(random, cylinders)
        if (start and target) or apart((begin.x_m, begin.y_m), end):
            return Task(start=begin, target=end)


def chosen_task(
    random: np.random.Generator, chosen: Mapping[str, Any], cylinders: Sequence[Point] = CYLINDERS
) -> Task:
    """Return a task whose `start` (x, y, heading; or a Pose) and `target` (x, y) may be chosen.

    Raises:
        ConfigurationError: an unknown name, a wrong number of values, a target inside a wall or a
            cylinder, or a start at which the robot would touch one.
    """
    if unknown := sorted(set(chosen) - {"start", "target"}):
        raise ConfigurationError(f"reset option {unknown[0]!r} is not known; use start or target")
    start, target = chosen.get("start"), chosen.get("target")
    if start is not None:
        if not isinstance(start, Pose):
            start = Pose(*_numbers("start", start, ("x", "y", "heading")))
        _check_place("start", start.x_m, start.y_m, OUTLINE_M, cylinders)
    if target is not None:
        x_m, y_m = _numbers("target", target, ("x", "y"))
        _check_place("target", x_m, y_m, 0.0, cylinders)
        target = x_m, y_m
    return draw_task(random, start, target, cylinders)


def _numbers(name: str, given: Any, wanted: tuple[str, ...]) -> list[float]:
    """Return the wanted numbers from any value that numpy accepts as a row of numbers."""
    with suppress(TypeError, ValueError):
        row = np.asarray(given, dtype=float)
        if row.shape == (len(wanted),):
            return [float(number) for number in row]
    raise ConfigurationError(
        f"reset option {name}: {given!r} is not {len(wanted)} numbers; give {', '.join(wanted)}"
    )


def _check_place(name: str, x_m: float, y_m: float, radius_m: float, cylinders: Sequence[Point]) -> None:
    """Refuse a place without `radius_m` of free floor around it; the simulator would push the robot away."""
    if not gap(x_m, y_m, cylinders) > radius_m:  # written so that NaN is refused too
        fact = "is in a wall or a cylinder" if not radius_m else "puts the robot in a wall or a cylinder"
        raise ConfigurationError(
            f"reset option {name}: ({x_m:g}, {y_m:g}) {fact}; choose a free place within"
            f" {HALF_SIDE_M - radius_m:g} m of the center on each axis"
        )
