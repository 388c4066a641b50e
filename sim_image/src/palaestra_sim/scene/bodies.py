"""The body of a robot in the physics: its position, its motion, and its contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from palaestra_sim.scene.links import Link
from palaestra_sim.scene.mass import MassProperties
from palaestra_sim.scene.mobile_base import MobileBase
from palaestra_sim.scene.shapes import Shape


@dataclass(frozen=True, slots=True, kw_only=True)
class Build:
    """The parts of a robot's body.

    Attributes:
        base: the robot's wheels, and the motion that they command.
        outline: the shapes with which the robot collides, in the robot's frame.
        heights: z of the lower and of the upper end of the body, in the robot's frame.
        links: the parts on the robot's joints that forces move; empty if the physics has no such joints.
        matter: the masses of the parts that are not on a link.
    """

    base: MobileBase
    outline: Sequence[Shape]
    heights: tuple[float, float]
    links: Sequence[Link] = ()
    matter: Sequence[MassProperties] = ()


class Body(Protocol):
    """A robot that stands on the floor: a pose, a velocity, and wheels if it has any.

    Attributes:
        base: the robot's wheels, and the motion that they command.
        x, y: the position of the robot's origin in the world, in meters, in the axes of the ground.
        heading_rad: the heading, in (-pi, pi].
        c, s: cosine and sine of the heading.
        velocity: vx, vy in m/s and omega in rad/s, in world axes, over the last basic step.
        touched: one bit for each part that was touched since the bumpers were last read; the code that reads
            the bumpers clears the bits.
    """

    base: MobileBase
    x: float
    y: float
    heading_rad: float
    c: float
    s: float
    velocity: tuple[float, float, float]
    touched: int

    @property
    def rim(self) -> Sequence[Shape]:
        """The shapes of the body that can touch other objects, some of them several times."""
        ...

    def bits(self, outline: Sequence[Shape]) -> int:
        """Return the parts of the body that match these shapes, as bits of `touched`."""
        ...

    def place(self, x: float, y: float, heading_rad: float) -> None:
        """Set the position and heading of the robot; its motion continues."""
        ...

    def halt(self) -> None:
        """Stop all motion, including the motion of the motors."""
        ...

    def push(self, vx: float, vy: float, omega: float) -> None:
        """Give the body a velocity in world axes; its motors continue from this velocity."""
        ...
