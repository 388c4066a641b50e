"""A robot as the physics has it: where it is, how it moves, and what it has touched."""

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
    """What a robot's body is made of.

    Attributes:
        base: its wheels.
        outline: the shapes with which it runs into things, in its own frame.
        heights: z of the lower and upper end of the body, in its own frame.
        links: what moves on its joints by forces; empty in a physics without such joints.
        matter: the masses of what is on no link.
    """

    base: MobileBase
    outline: Sequence[Shape]
    heights: tuple[float, float]
    links: Sequence[Link] = ()
    matter: Sequence[MassProperties] = ()


class Body(Protocol):
    """A robot that stands on the floor: a pose, a velocity, and wheels where it has any.

    Attributes:
        base: its wheels.
        x, y: of its origin in the world, in meters, in the axes of the ground.
        heading_rad: in (-pi, pi].
        c, s: cosine and sine of the heading.
        velocity: vx, vy in m/s and omega in rad/s, in world axes, over the last basic step.
        touched: the parts that were touched since the bumpers were last read, a bit each; their reader clears
            it.
    """

    base: MobileBase
    x: float
    y: float
    heading_rad: float
    c: float
    s: float
    velocity: tuple[float, float, float]
    touched: int

    def bits(self, outline: Sequence[Shape]) -> int:
        """Return the parts of the body that these shapes are, as bits of `touched`."""
        ...

    def place(self, x: float, y: float, heading_rad: float) -> None:
        """Place the robot somewhere; its motion continues."""
        ...

    def halt(self) -> None:
        """Stop all motion; the motors begin again from rest."""
        ...

    def push(self, vx: float, vy: float, omega: float) -> None:
        """Give the body a velocity in world axes; its motors start from there."""
        ...
