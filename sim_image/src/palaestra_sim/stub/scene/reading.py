"""Reading a scene: `USE` resolved, numbers checked, and errors with their place.

The stub refuses what it cannot simulate, by line and column, rather than simulate something else. A refusal
is noted, and the reading goes on: `conclude` raises one error for all of them.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable
from typing import Final

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.stub.physics.geometry import AxisAngle, Pose, Vector, from_axis_angle
from palaestra_sim.world import Node, World
from palaestra_sim.world.source import Source

ELSEWHERE: Final = "remove it, or run this world with driver webots"


class Reading:
    """A world that is being read: it finds `DEF`s, reads numbers, and collects errors."""

    def __init__(self, world: World, name: str) -> None:
        self.world = world
        self._source = Source(data=world.source, name=name)
        self._refused: list[WorldError] = []
        self._defs: dict[str, list[Node]] = {}
        for node in world.walk():
            if node.def_name is not None:
                self._defs.setdefault(node.def_name, []).append(node)

    def refuse(self, node: Node, fact: str, remedy: str = ELSEWHERE) -> None:
        """Record that `node` cannot be simulated."""
        self._refused.append(self._source.error(node.span[0], fact, remedy))

    def conclude(self) -> None:
        """Return if nothing was refused.

        Raises:
            WorldError: everything that was refused.
        """
        if error := refusal(self._refused):
            raise error

    def resolve(self, node: Node) -> Node:
        """Return the node itself, or the one that it `USE`s: the last of that name before it.

        Raises:
            WorldError: no node of that name stands before it.
        """
        if node.uses is None:
            return node
        named = self._defs.get(node.uses, [])
        before = bisect_right([it.span[0] for it in named], node.span[0])
        if before == 0:
            raise self._source.error(node.span[0], f"USE {node.uses} has no DEF before it", "define it first")
        return named[before - 1]

    def children(self, node: Node, field: str = "children") -> tuple[Node, ...]:
        """Return the nodes of a field, each `USE` resolved as in `resolved`."""
        return self.resolved(node.nodes(field))

    def resolved(self, nodes: Iterable[Node]) -> tuple[Node, ...]:
        """Return `nodes` with each `USE` resolved; one whose `DEF` is missing is refused and left out."""
        found = []
        for node in nodes:
            try:
                found.append(self.resolve(node))
            except WorldError as error:
                self._refused.append(error)
        return tuple(found)

    def vector(self, node: Node, field: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return as many finite numbers as `default` has; `default` if the field is refused."""
        if field not in node.fields:
            return default
        numbers = node.numbers(field)
        if numbers is None or len(numbers) != len(default) or not all(map(math.isfinite, numbers)):
            wanted = "a number" if len(default) == 1 else f"{len(default)} numbers"
            self.refuse(node, f"{node.type_name}.{field} is not {wanted}", f"write {wanted}")
            return default
        return numbers

    def number(self, node: Node, field: str, default: float) -> float:
        """Return the number of a field; `default` if the field is refused."""
        return self.vector(node, field, (default,))[0]

    def translation(self, node: Node) -> Vector:
        """Return `translation` in meters."""
        x, y, z = self.vector(node, "translation", (0.0, 0.0, 0.0))
        return x, y, z

    def rotation(self, node: Node) -> AxisAngle:
        """Return `rotation`, axis and angle."""
        x, y, z, angle_rad = self.vector(node, "rotation", (0.0, 0.0, 1.0, 0.0))
        return x, y, z, angle_rad

    def pose(self, node: Node) -> Pose:
        """Return the frame of a node in the frame around it."""
        return Pose(self.translation(node), from_axis_angle(self.rotation(node)))
