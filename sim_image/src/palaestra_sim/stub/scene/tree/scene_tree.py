"""The scene tree of a supervisor: nodes found by DEF, number or device, and their fields.

Handles are numbers that look like the addresses of Webots. They are valid for one load of a world; a service
refuses a handle of another load. (In Webots such a handle is a dangling pointer: the controller may crash.
Never keep one.)
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Final

from palaestra_sim.errors import SimError
from palaestra_sim.stub.scene.reading import Reading
from palaestra_sim.stub.scene.robot import Robot
from palaestra_sim.stub.scene.simulation import Simulation
from palaestra_sim.stub.scene.tree.fields import Field
from palaestra_sim.stub.scene.tree.nodes import SceneNode
from palaestra_sim.world import Node

_FIRST_ADDRESS: Final = 0x5580_0000_0000  # where Linux puts the heap of a position-independent program
_LOAD_SPACING: Final = 0x0001_0000_0000
_SPACING: Final = 0x90


class NoSuchHandleError(SimError, LookupError):
    """This load of the world never returned that handle; Webots would crash or worse."""


class SceneTree:
    """All nodes of one load of a world, and the handles of nodes and fields.

    Args:
        simulation: of that world.
        load: how many worlds were loaded before: makes handles of different loads different.
    """

    def __init__(self, simulation: Simulation, load: int = 0) -> None:
        self.simulation = simulation
        self._next_handle = _FIRST_ADDRESS + (load + 1) * _LOAD_SPACING
        self._held: dict[int, SceneNode | Field] = {}
        self._fields: dict[tuple[int, str], Field] = {}
        self.nodes: list[SceneNode] = []
        self._reading = Reading(simulation.world, "world")
        self._robots = {robot.parts.node.span[0]: robot for robot in simulation.robots}
        self.root = self._new_node(None, None)
        self.root.inside["children"] = [
            self._grow(node, self.root, jointed=False) for node in simulation.world.nodes
        ]
        outlines = frozenset(self._first_bytes_of_outlines())
        for node in self.nodes:
            node.outline = node.source is not None and node.source.span[0] in outlines

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

    def field_of(self, node: SceneNode, name: str) -> Field | None:
        """Return a node's field; None if a node of this type has none of that name."""
        found = self._fields.get((node.number, name))
        kind = node.kinds.get(name) if found is None else None
        if kind is not None:
            found = self._fields[node.number, name] = Field(node, name, kind, self.simulation)
            found.handle = self._new_handle(found)
        return found

    def of_def(self, path: str) -> SceneNode | None:
        """Return the first node with a DEF name; dots lead inside, as in "ROBOT.ARM"."""
        found: SceneNode | None = self.root
        for name in path.split("."):
            if found is None or not name:
                return None
            found = next(
                (descendant for descendant in found.descendants() if descendant.def_name == name), None
            )
        return found

    def of_number(self, number: int) -> SceneNode | None:
        """Return the node whose `get_id` is `number`."""
        return self.nodes[number] if 0 <= number < len(self.nodes) else None

    def of_robot(self, robot: Robot) -> SceneNode:
        """Return the node of a robot."""
        return next(node for node in self.nodes if node.robot is robot)

    def of_device(self, robot: Robot, name: str) -> SceneNode | None:
        """Return the node of a robot's device by its name in the world file."""
        if name not in robot.parts.devices.rows:
            return None
        inside = self.of_robot(robot).descendants()
        return next((it for it in inside if it.source and it.source.text("name") == name), None)

    def _new_node(self, source: Node | None, parent: SceneNode | None) -> SceneNode:
        node = SceneNode(len(self.nodes), source, parent)
        node.handle = self._new_handle(node)
        self.nodes.append(node)
        return node

    def _new_handle(self, held: SceneNode | Field) -> int:
        handle = self._next_handle
        self._next_handle += _SPACING
        self._held[handle] = held
        return handle

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
