"""The scene tree as a supervisor sees it: nodes found by DEF, number or device, each with its fields.

Handles are numbers that look like the addresses Webots gives out. They hold for one load of a world;
a handle from another load names nothing here, which a service then tells. (In Webots such a handle
is a dangling pointer: the controller may crash. Never keep one.)
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from typing import Final

from palaestra_sim.errors import SimError
from palaestra_sim.stub.catalogue import FieldKind, field_kinds, type_number
from palaestra_sim.stub.fields import Field, guessed_kind
from palaestra_sim.stub.places import Place
from palaestra_sim.stub.reading import Reading
from palaestra_sim.stub.robot import Robot
from palaestra_sim.stub.simulation import Simulation
from palaestra_sim.world import Node

_FIRST_ADDRESS: Final = 0x5580_0000_0000  # where Linux puts the heap of a position-independent program
_LOAD_SPACING: Final = 0x0001_0000_0000
_SPACING: Final = 0x90


class NoSuchHandleError(SimError, LookupError):
    """A handle that this load of the world never gave out; Webots would crash or worse."""


class SceneNode:
    """One node of the tree.

    Attributes:
        handle: for clients.
        number: what `get_id` answers; 0 is the root.
        source: the node in the world file; None for the root.
        parent: None for the root.
        place: where it stands, None for nodes without a place, such as appearances.
        robot: the robot that it is; None for all other nodes.
        jointed: whether it hangs on a joint, which does not move it here.
    """

    def __init__(self, tree: SceneTree, source: Node | None, parent: SceneNode | None) -> None:
        self.number = tree.count
        self.handle = tree.new_handle(self)
        self.source = source
        self.parent = parent
        self.type_name = source.type_name if source is not None else "Group"
        self.def_name = (source.def_name if source is not None else None) or ""
        self.place: Place | None = None
        self.robot: Robot | None = None
        self.jointed = False
        self.inside: dict[str, list[SceneNode]] = {}
        self._tree = tree
        self._fields: dict[str, Field] = {}

    @property
    def type_number(self) -> int:
        """The number that `get_type` answers."""
        return type_number(self.type_name)

    @property
    def kinds(self) -> dict[str, FieldKind]:
        """The fields it has, in the order that indices count."""
        return _kinds(self.type_name) | self._written_kinds()

    def field(self, name: str) -> Field | None:
        """Return a field; None when a node of this type has none of that name."""
        if name not in self._fields:
            kind = self.kinds.get(name)
            if kind is None:
                return None
            self._fields[name] = Field(self._tree, self, name, kind)
        return self._fields[name]

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


class SceneTree:
    """All nodes of one load of a world, and the handles given out for them.

    Args:
        simulation: what the nodes are of.
        load: how many worlds were loaded before: makes handles of different loads different.
    """

    def __init__(self, simulation: Simulation, load: int = 0) -> None:
        self.simulation = simulation
        self._next_handle = _FIRST_ADDRESS + (load + 1) * _LOAD_SPACING
        self._held: dict[int, SceneNode | Field] = {}
        self.nodes: list[SceneNode] = []
        self._reading = Reading(simulation.world, "world")
        self._robots = {it.parts.node.span[0]: it for it in simulation.robots}
        self.root = self._new_node(None, None)
        self.root.inside["children"] = [
            self._grow(node, self.root, jointed=False) for node in simulation.world.nodes
        ]
        self._outlines = frozenset(self._first_bytes_of_outlines())

    @property
    def count(self) -> int:
        """How many nodes there are so far: the number of the next one."""
        return len(self.nodes)

    def new_handle(self, held: SceneNode | Field) -> int:
        """Return the handle that will stand for a node or field until the next load."""
        handle = self._next_handle
        self._next_handle += _SPACING
        self._held[handle] = held
        return handle

    def node(self, handle: int) -> SceneNode:
        """Return the node of a handle.

        Raises:
            NoSuchHandleError: it is 0, of another load, or never was one of a node.
        """
        held = self._held.get(handle)
        if not isinstance(held, SceneNode):
            raise NoSuchHandleError(f"node {handle:#x} does not exist; get a new handle")
        return held

    def field(self, handle: int) -> Field:
        """Return the field of a handle.

        Raises:
            NoSuchHandleError: it is 0, of another load, or never was one of a field.
        """
        held = self._held.get(handle)
        if not isinstance(held, Field):
            raise NoSuchHandleError(f"field {handle:#x} does not exist; get a new handle")
        return held

    def of_def(self, path: str) -> SceneNode | None:
        """Return the first node with a DEF name; dots lead inside, as in "ROBOT.ARM"."""
        found: SceneNode | None = self.root
        for name in path.split("."):
            if found is None or not name:
                return None
            found = next((it for it in found.descendants() if it.def_name == name), None)
        return found

    def of_number(self, number: int) -> SceneNode | None:
        """Return the node whose `get_id` is `number`."""
        return self.nodes[number] if 0 <= number < len(self.nodes) else None

    def of_robot(self, robot: Robot) -> SceneNode:
        """Return the node of a robot."""
        return next(it for it in self.nodes if it.robot is robot)

    def of_device(self, robot: Robot, name: str) -> SceneNode | None:
        """Return the node of a robot's device by its name in the world file."""
        if name not in robot.parts.devices.order:
            return None
        inside = self.of_robot(robot).descendants()
        return next((it for it in inside if it.source and it.source.text("name") == name), None)

    def _new_node(self, source: Node | None, parent: SceneNode | None) -> SceneNode:
        node = SceneNode(self, source, parent)
        self.nodes.append(node)
        return node

    def is_outline(self, node: SceneNode) -> bool:
        """Say whether a node is part of a boundingObject, here or where it is `USE`d."""
        return node.source is not None and node.source.span[0] in self._outlines

    def _first_bytes_of_outlines(self) -> Iterator[int]:
        for node in self.nodes:
            for outline in node.inside.get("boundingObject", ()):
                yield from (it.source.span[0] for it in (outline, *outline.descendants()) if it.source)

    def _grow(self, written: Node, parent: SceneNode, *, jointed: bool) -> SceneNode:
        """Return the node for `written`; one that is `USE`d is a node of its own, as in Webots."""
        source = self._reading.resolve(written)
        node = self._new_node(source, parent)
        node.jointed = jointed
        if source is written:
            node.place = self.simulation.place_of(source.span[0])
            node.robot = self._robots.get(source.span[0])
        for name in source.fields:
            inner = source.nodes(name)
            if inner:
                on_joint = jointed or name == "endPoint"
                node.inside[name] = [self._grow(it, node, jointed=on_joint) for it in inner]
        return node
