"""One node of the scene tree of a supervisor: its type, its place, and the nodes inside it."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from palaestra_sim.stub.scene.places import Place
from palaestra_sim.stub.scene.robot import Robot
from palaestra_sim.stub.scene.tree.catalogue import FieldKind, field_kinds, guessed_kind, type_number
from palaestra_sim.world import Node


class SceneNode:
    """One node of the tree.

    Attributes:
        number: the answer of `get_id`; 0 is the root.
        handle: for clients; the tree sets it.
        source: the node in the world file; None for the root.
        parent: None for the root.
        place: its frame; None for a node without one, such as an appearance.
        robot: the robot that it is; None for all other nodes.
        jointed: whether it is on a joint, which does not move it here.
        outline: whether it is part of a boundingObject, here or where it is `USE`d.
        inside: the nodes in each of its fields.
    """

    def __init__(self, number: int, source: Node | None, parent: SceneNode | None) -> None:
        self.number = number
        self.handle = 0
        self.source = source
        self.parent = parent
        self.type_name = source.type_name if source is not None else "Group"
        self.def_name = (source.def_name if source is not None else None) or ""
        self.place: Place | None = None
        self.robot: Robot | None = None
        self.jointed = False
        self.outline = False
        self.inside: dict[str, list[SceneNode]] = {}

    @property
    def type_number(self) -> int:
        """The number that `get_type` answers."""
        return type_number(self.type_name)

    @property
    def kinds(self) -> dict[str, FieldKind]:
        """Its fields, in the order of their indices."""
        return _kinds(self.type_name) | self._written_kinds()

    def descendants(self) -> Iterator[SceneNode]:
        """Yield every node inside, parents before children."""
        for nodes in self.inside.values():
            for node in nodes:
                yield node
                yield from node.descendants()

    def _written_kinds(self) -> dict[str, FieldKind]:
        known = _kinds(self.type_name)
        written = self.source.fields if self.source is not None else {}
        return {name: guessed_kind(value) for name, value in written.items() if name not in known}


@cache
def _kinds(type_name: str) -> dict[str, FieldKind]:
    return field_kinds(type_name)
