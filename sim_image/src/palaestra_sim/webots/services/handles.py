"""The handles by which clients of a supervisor refer to nodes and fields: pointers of libController.

libController checks a node's pointer, but crashes at the pointer of a field that it did not return. So only
pointers that a service has returned are accepted.
"""

from __future__ import annotations

from palaestra_sim.errors import SimError


class UnknownHandleError(SimError, LookupError):
    """No service of this supervisor has returned that handle."""


class WebotsHandles:
    """The handles that the services of one supervisor have returned."""

    def __init__(self) -> None:
        self._nodes: set[int] = set()
        self._fields: set[int] = set()

    def of_node(self, pointer: int | None) -> int:
        """Return the handle of a node; 0 for NULL."""
        if pointer is None:
            return 0
        self._nodes.add(pointer)
        return pointer

    def of_field(self, pointer: int | None) -> int:
        """Return the handle of a field; 0 for NULL."""
        if pointer is None:
            return 0
        self._fields.add(pointer)
        return pointer

    def node(self, handle: int) -> int:
        """Return the pointer of a node.

        Raises:
            UnknownHandleError: no service has returned this handle as that of a node.
        """
        if handle not in self._nodes:
            raise UnknownHandleError(f"node {handle:#x} does not exist; get a new handle")
        return handle

    def other_node(self, handle: int) -> int | None:
        """Return the pointer of the second node of a request; for the handle 0, None, which means the world.

        Raises:
            UnknownHandleError: no service has returned this handle as that of a node.
        """
        return self.node(handle) if handle else None

    def field(self, handle: int) -> int:
        """Return the pointer of a field.

        Raises:
            UnknownHandleError: no service has returned this handle as that of a field.
        """
        if handle not in self._fields:
            raise UnknownHandleError(f"field {handle:#x} does not exist; get a new handle")
        return handle
