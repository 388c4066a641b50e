"""Tasks on a floor: drive from a start to a target, both at free positions of a layout.

The layout comes from the scene, so this module does not depend on a world. A position is free if a robot
there keeps a distance of `CLEARANCE_M` between its outline and every obstacle.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.layout import FloorLayout

CLEARANCE_M = 0.10  # least distance between the robot's outline and obstacles, at the start and on the target
OF_THE_RUN = ("training_progress", "episode")  # options of every reset in a run; not used here
APART_M = 1.0  # smallest distance from start to target
MOST_DRAWS = 10_000  # after this many random points without a free one, the layout counts as full


@dataclass(frozen=True, slots=True)
class EpisodeTask:
    """One episode's task: from `start` to `target` (x, y in meters)."""

    start: Pose
    target: Point


@dataclass(frozen=True, slots=True, kw_only=True)
class FreePlaces:
    """The free positions of a layout for a robot.

    Attributes:
        layout: the floor and the obstacles on it.
        radius_m: radius of the robot's outline.
        apart_m: smallest distance from start to target.
    """

    layout: FloorLayout
    radius_m: float
    apart_m: float = APART_M

    def free(self, x_m: float, y_m: float) -> bool:
        """Return whether the robot at this position keeps at least `CLEARANCE_M` from every obstacle."""
        return self.layout.gap(x_m, y_m) >= self.radius_m + CLEARANCE_M

    def draw(self, random: np.random.Generator) -> Point:
        """Return x, y in meters of a random free position; all free positions are equally likely.

        Raises:
            ConfigurationError: the floor has no free position.
        """
        low, high = self.layout.low, self.layout.high
        for _ in range(MOST_DRAWS):
            x_m, y_m = random.uniform(low, high).tolist()
            if self.free(x_m, y_m):
                return x_m, y_m
        raise self._full()

    def draw_from(self, random: np.random.Generator, start: Point) -> Point:
        """Return a random free position at least `apart_m` from `start`.

        Raises:
            ConfigurationError: the floor has no such position.
        """
        for _ in range(MOST_DRAWS):
            target = self.draw(random)
            if math.dist(start, target) >= self.apart_m:
                return target
        raise self._full()

    def draw_task(
        self, random: np.random.Generator, start: Pose | None = None, target: Point | None = None
    ) -> EpisodeTask:
        """Return a task with random free positions and a random heading, except for the given values.

        Raises:
            ConfigurationError: the floor has no free positions at least `apart_m` apart.
        """
        heading_rad = float(random.uniform(-math.pi, math.pi))
        if start and target:
            return EpisodeTask(start=start, target=target)
        if start:
            return EpisodeTask(start=start, target=self.draw_from(random, (start.x_m, start.y_m)))
        if target:
            return EpisodeTask(start=Pose(*self.draw_from(random, target), heading_rad), target=target)
        for _ in range(MOST_DRAWS):
            begin, end = self.draw(random), self.draw(random)
            if math.dist(begin, end) >= self.apart_m:
                return EpisodeTask(start=Pose(*begin, heading_rad), target=end)
        raise self._full()

    def chosen_task(self, random: np.random.Generator, chosen: Mapping[str, Any]) -> EpisodeTask:
        """Return a random task, with the values that `chosen` sets.

        `chosen` may have `start`, which is x, y, heading or a Pose, and `target`, which is x, y.

        Raises:
            ConfigurationError: a name in `chosen` is unknown, the number of values is wrong, the target is in
                an obstacle, the robot would touch an obstacle at the start, or the floor has no free
                position.
        """
        if unknown := sorted(set(chosen) - {"start", "target", *OF_THE_RUN}):
            raise ConfigurationError(f"reset option {unknown[0]!r} is not known; use start or target")
        start, target = chosen.get("start"), chosen.get("target")
        if start is not None:
            if not isinstance(start, Pose):
                start = Pose(*_numbers("start", start, ("x", "y", "heading")))
            self._check("start", start.x_m, start.y_m, self.radius_m)
        if target is not None:
            x_m, y_m = _numbers("target", target, ("x", "y"))
            self._check("target", x_m, y_m, 0.0)
            target = x_m, y_m
        return self.draw_task(random, start, target)

    def _check(self, name: str, x_m: float, y_m: float, radius_m: float) -> None:
        """Refuse a position without `radius_m` of free floor; the simulator would push a robot out of it."""
        if self.layout.gap(x_m, y_m) > radius_m:  # false for NaN too
            return
        fact = "puts the robot in an obstacle" if radius_m else "is in an obstacle"
        least, most = (
            [edge + sign * radius_m for edge in edges]
            for sign, edges in ((1.0, self.layout.low), (-1.0, self.layout.high))
        )
        raise ConfigurationError(
            f"reset option {name}: ({x_m:g}, {y_m:g}) {fact} or beyond the floor; choose a free position with"
            f" x from {least[0]:g} to {most[0]:g} and y from {least[1]:g} to {most[1]:g}"
        )

    def _full(self) -> ConfigurationError:
        return ConfigurationError(
            f"the layout of the world has no free places for a robot of radius {self.radius_m:g} m that are"
            f" {self.apart_m:g} m apart; use a larger floor or fewer obstacles"
        )


def _numbers(name: str, given: Any, wanted: tuple[str, ...]) -> list[float]:
    """Return the numbers of a value that NumPy can convert to a one-dimensional array."""
    with suppress(TypeError, ValueError):
        row = np.asarray(given, dtype=float)
        if row.shape == (len(wanted),):
            return [float(number) for number in row]
    raise ConfigurationError(
        f"reset option {name}: {given!r} is not {len(wanted)} numbers; give {', '.join(wanted)}"
    )
