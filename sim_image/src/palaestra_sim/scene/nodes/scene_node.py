"""One node of a loaded world: its type, its current fields, its frame, the nodes inside it.

Each node has a unique `number`, which does not depend on the bytes of a file. So a node inside a PROTO, a
node of a `USE`, and a node that a client imports have numbers too.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TypeAlias

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.frames import Frame
from palaestra_sim.world import Node
from palaestra_sim.world.source import Source

Content: TypeAlias = "float | bool | str | SceneNode | None"


@dataclass(slots=True, eq=False)
class FieldContent:
    """The values of a field: numbers, booleans, strings, nodes, None for NULL.

    Attributes:
        items: the values, in order; each number of a vector is one item.
        bracketed: whether the file has the values in brackets.
    """

    items: list[Content]
    bracketed: bool = False


@dataclass(frozen=True, slots=True)
class Origin:
    """The position of a node in a file: its node in the tree of the file, and the bytes of the file."""

    node: Node
    source: Source

    def error(self, fact: str, remedy: str) -> WorldError:
        """Return an error at this position."""
        return self.source.error(self.node.span[0], fact, remedy)


class SceneNode:
    """One node of the tree.

    Attributes:
        number: the response of `get_id`; 0 is the root.
        origin: the position of the node in its file; None for the root.
        type_name: the type of the node, such as "Solid".
        proto_name: the PROTO of which the node is an instance; "" if it is not an instance.
        def_name: the DEF name of the node; "" if it has no DEF name.
        parent: the node that contains this node; None for the root.
        fields: the fields that the file or a client has set, by name.
        twins: this node and all nodes that are the same node in the file by `DEF` and `USE`; a write changes
            all twins.
        place: the frame of the node; None for a node without a frame, such as an appearance.
        outline: whether the node, or one of its twins, is part of a boundingObject.
        shipped: whether the node is an instance of a Webots PROTO whose built-in file has the current axes.
        stand_in: whether the node is a simple solid that replaces a PROTO.
        unusable: the reason why the node's PROTO cannot be expanded; "" if it can be expanded.
        left_out: whether the node is not simulated, because the user left it out.
    """

    def __init__(self, number: int, type_name: str, origin: Origin | None, parent: SceneNode | None) -> None:
        self.number = number
        self.origin = origin
        self.parent = parent
        self.type_name = type_name
        self.proto_name = ""
        self.def_name = ""
        self.fields: dict[str, FieldContent] = {}
        self.twins: list[SceneNode] = [self]
        self.place: Frame | None = None
        self.outline = False
        self.shipped = False
        self.stand_in = False
        self.unusable = ""
        self.left_out = False

    def numbers(self, name: str) -> tuple[float, ...] | None:
        """Return the numbers of a field; None if it is absent or has another value."""
        content = self.fields.get(name)
        if content is None:
            return None
        numbers = tuple(item for item in content.items if isinstance(item, float))
        return numbers if len(numbers) == len(content.items) else None

    def text(self, name: str) -> str | None:
        """Return the first string of a field; None if the field has no string."""
        return next(iter(self.texts(name)), None)

    def texts(self, name: str) -> tuple[str, ...]:
        """Return the strings of a field; () if it is absent."""
        return tuple(item for item in self._items(name) if isinstance(item, str))

    def flag(self, name: str, default: bool) -> bool:  # noqa: FBT001 - reads as in the world
        """Return the TRUE or FALSE of a field; `default` if the field has neither."""
        return next((item for item in self._items(name) if isinstance(item, bool)), default)

    def nodes(self, name: str = "children") -> tuple[SceneNode, ...]:
        """Return the nodes of a field; () if it is absent."""
        return tuple(item for item in self._items(name) if isinstance(item, SceneNode))

    def inside(self) -> Iterator[SceneNode]:
        """Yield the nodes in the fields of this node, in the order of the fields."""
        for content in self.fields.values():
            yield from (item for item in content.items if isinstance(item, SceneNode))

    def descendants(self) -> Iterator[SceneNode]:
        """Yield all nodes inside this node at any depth, parents before children."""
        for node in self.inside():
            yield node
            yield from node.descendants()

    def outlining(self) -> Iterator[SceneNode]:
        """Yield all nodes in this node's boundingObject."""
        for outline in self.nodes("boundingObject"):
            yield outline
            yield from outline.descendants()

    def ancestors(self) -> Iterator[SceneNode]:
        """Yield the nodes that contain this node, from the parent to the root."""
        node = self.parent
        while node is not None:
            yield node
            node = node.parent

    def _items(self, name: str) -> list[Content]:
        content = self.fields.get(name)
        return [] if content is None else content.items
