"""The handles by which clients of a supervisor refer to nodes and fields.

A handle is a number that looks like a memory address, because Webots' handles are memory addresses. A handle
is valid until the world is loaded again; after that, services refuse the old handle. In Webots an old handle
is a dangling pointer and may crash the controller, so clients must request new handles after each load.
"""

from __future__ import annotations

from typing import Final

from palaestra_sim.errors import SimError
from palaestra_sim.ros_controller.backend import Backend
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.tree.fields import NodeField

_FIRST_ADDRESS: Final = 0x5580_0000_0000  # Linux places the heap of a program near this address
_LOAD_SPACING: Final = 0x0001_0000_0000
_SPACING: Final = 0x90


class NoSuchHandleError(SimError, LookupError):
    """The loaded world has no node or field for the handle; Webots might crash at such a handle."""


class Handles:
    """The handles of one load of a world.

    Args:
        simulation: the simulation of that world.
        load: the number of earlier loads, so that different loads have different handles.
    """

    def __init__(self, simulation: Backend, load: int = 0) -> None:
        self.simulation = simulation
        self.tree = simulation.tree
        self._next = _FIRST_ADDRESS + (load + 1) * _LOAD_SPACING
        self._held: dict[int, SceneNode | NodeField] = {}
        self._handles: dict[SceneNode | NodeField, int] = {}

    def of(self, held: SceneNode | NodeField | None) -> int:
        """Return the handle of a node or field; 0 for None."""
        if held is None:
            return 0
        handle = self._handles.get(held)
        if handle is None:
            handle = self._handles[held] = self._next
            self._held[handle] = held
            self._next += _SPACING
        return handle

    def node(self, handle: int) -> SceneNode:
        """Return the node of a handle.

        Raises:
            NoSuchHandleError: the handle is 0, or belongs to another load of a world, to a removed node, or
                to a field.
        """
        held = self._held.get(handle)
        if not isinstance(held, SceneNode) or self._is_gone(held):
            raise NoSuchHandleError(f"node {handle:#x} does not exist; get a new handle")
        return held

    def field(self, handle: int) -> NodeField:
        """Return the field of a handle.

        Raises:
            NoSuchHandleError: the handle is 0, or belongs to another load of a world, to a field of a removed
                node, or to a node.
        """
        held = self._held.get(handle)
        if not isinstance(held, NodeField) or self._is_gone(held.node):
            raise NoSuchHandleError(f"field {handle:#x} does not exist; get a new handle")
        return held

    def _is_gone(self, node: SceneNode) -> bool:
        return self.tree.of_number(node.number) is not node

    def field_of(self, node: SceneNode, name: str) -> NodeField | None:
        """Return the field `name` of a node; None if its node type has no such field."""
        return self.tree.field_of(node, name, self.simulation)
