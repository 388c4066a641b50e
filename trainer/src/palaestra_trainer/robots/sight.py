"""The positions of robot and target on their floor after a step, for the recording of an episode."""

from __future__ import annotations

from dataclasses import dataclass

from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.layout import FloorLayout


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """The positions of robot and target after a step, seen from above.

    Attributes:
        pose: the robot's pose.
        target: x and y of the target in meters; None: the scene has not placed a target in this episode.
        floor: the floor and the objects on it at the start of the episode; None: the layout was not read.
        radius_m: radius of the robot's outline.
        period_s: seconds of simulated time in one step.
    """

    pose: Pose
    target: Point | None
    floor: FloorLayout | None
    radius_m: float
    period_s: float
