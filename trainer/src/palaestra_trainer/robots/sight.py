"""Where robot and target are on their floor: what a recording of an episode keeps of each step."""

from __future__ import annotations

from dataclasses import dataclass

from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.layout import FloorLayout


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """The state after a step, seen from above.

    Attributes:
        pose: the robot's pose.
        target: x and y of the target in meters; None: the episode has none that its scene placed.
        floor: the floor and the objects on it as the episode began; None: nothing has read them.
        radius_m: radius of the robot's outline.
        period_s: seconds of simulated time in one step.
    """

    pose: Pose
    target: Point | None
    floor: FloorLayout | None
    radius_m: float
    period_s: float
