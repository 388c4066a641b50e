"""What every part of reading a scene needs: `USE` resolved, numbers checked, errors that point.

A stub refuses what it cannot simulate, by line and column, rather than simulate something else.
"""

from __future__ import annotations

import math
from bisect import bisect_right
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.stub.geometry import AxisAngle, Pose, Vector, from_axis_angle
from palaestra_sim.world import Node, World
from palaestra_sim.world.source import Source

ELSEWHERE: Final = "remove it, or run this world with driver webots"


class Reading:
    """A world that is being read: finds `DEF`s, takes numbers, makes errors."""

    def __init__(self, world: World, name: str) -> None:
        self.world = world
        self._source = Source(data=world.source, name=name)
        self._defs: dict[str, list[Node]] = {}
        for node in world.walk():
            if node.def_name is not None:
                self._defs.setdefault(node.def_name, []).append(node)

    def error(self, node: Node, fact: str, remedy: str = ELSEWHERE) -> WorldError:
        """Return the error that points at `node`, for the caller to raise."""
        return self._source.error(node.span[0], fact, remedy)

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
            raise self.error(node, f"USE {node.uses} has no DEF before it", "define it first")
        return named[before - 1]

    def children(self, node: Node, field: str = "children") -> tuple[Node, ...]:
        """Return the nodes of a field, `USE` resolved.

        Raises:
            WorldError: a `USE` has no `DEF`.
        """
        return tuple(self.resolve(child) for child in node.nodes(field))

    def vector(self, node: Node, field: str, default: tuple[float, ...]) -> tuple[float, ...]:
        """Return as many finite numbers as `default` has.

        Raises:
            WorldError: the field holds anything else.
        """
        if field not in node.fields:
            return default
        numbers = node.numbers(field)
        if numbers is None or len(numbers) != len(default) or not all(map(math.isfinite, numbers)):
            wanted = "a number" if len(default) == 1 else f"{len(default)} numbers"
            raise self.error(node, f"{node.type_name}.{field} is not {wanted}", f"write {wanted}")
        return numbers

    def number(self, node: Node, field: str, default: float) -> float:
        """Return the number of a field.

        Raises:
            WorldError: the field holds anything else.
        """
        return self.vector(node, field, (default,))[0]

    def translation(self, node: Node) -> Vector:
        """Return `translation` in metres.

        Raises:
            WorldError: it isn't three numbers.
        """
        x, y, z = self.vector(node, "translation", (0.0, 0.0, 0.0))
        return x, y, z

    def rotation(self, node: Node) -> AxisAngle:
        """Return `rotation`, axis and angle.

        Raises:
            WorldError: it isn't four numbers.
        """
        x, y, z, angle_rad = self.vector(node, "rotation", (0.0, 0.0, 1.0, 0.0))
        return x, y, z, angle_rad

    def pose(self, node: Node) -> Pose:
        """Return the frame of a node in the frame around it.

        Raises:
            WorldError: `translation` or `rotation` is malformed.
        """
        return Pose(self.translation(node), from_axis_angle(self.rotation(node)))
