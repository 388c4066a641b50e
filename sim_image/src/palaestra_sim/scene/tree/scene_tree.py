"""The tree of a loaded world: nodes by DEF or number, and their fields."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.scene.mesh_files import MeshFiles
from palaestra_sim.scene.nodes.instantiate import Descriptions, Instantiator
from palaestra_sim.scene.nodes.scene_node import FieldContent, SceneNode
from palaestra_sim.scene.nodes.scope import Scope
from palaestra_sim.scene.tree.field_types import kinds_of
from palaestra_sim.scene.tree.fields import Changes, NodeField
from palaestra_sim.world import World, parse_nodes
from palaestra_sim.world.source import Source

_TEXT: Final = "node"  # the name by which errors refer to an imported text


class SceneTree:
    """All nodes of a loaded world.

    Args:
        world: the parsed world.
        name: the name of the world file, in errors.
        descriptions: the descriptions of the types that are not base types, and the files that nodes name.

    Attributes:
        source: the bytes of the world.
        nodes: all nodes, by number.
        root: a Group that has the nodes of the file as its children.
        refused: mistakes in the file because of which a node is missing, such as `USE` of an unknown name.
        ignored: fields that a PROTO does not have, each with its position in the file.
        read: returns the bytes of a file that a node names; without it, no file can be read.
        mesh_files: the mesh files that nodes name.
    """

    def __init__(self, world: World, name: str = "world", descriptions: Descriptions | None = None) -> None:
        self.source = world.source
        descriptions = descriptions or Descriptions()
        self._grower = Instantiator(descriptions)
        self.read = descriptions.read
        self.mesh_files = MeshFiles(descriptions.read)
        self.root = self._grower.root(world, name)
        self.nodes: dict[int, SceneNode] = self._grower.nodes
        self.refused: list[WorldError] = self._grower.refused
        self.ignored: list[WorldError] = self._grower.ignored
        self._fields: dict[tuple[int, str], NodeField] = {}
        _mark_outlines(self.nodes.values())

    def grow(self, text: str, parent: SceneNode) -> list[SceneNode]:
        """Return the nodes that `text` describes; `parent` is their parent, but does not hold them yet.

        Raises:
            WorldError: the text is wrong; the error lists all mistakes.
        """
        world = parse_nodes(text, _TEXT)
        known = len(self.refused)
        scope = Scope.of(Source(data=world.source, name=_TEXT, headless=True), world.nodes)
        grown = [it for it in self._grower.grow(world.nodes, scope, parent) if isinstance(it, SceneNode)]
        mistakes, self.refused[known:] = self.refused[known:], []
        if error := refusal(mistakes):
            self.forget(grown)
            raise error
        _mark_outlines([inside for node in grown for inside in (node, *node.descendants())])
        return grown

    def attach(self, nodes: Sequence[SceneNode], field: str, index: int) -> None:
        """Insert nodes into a field of their parent, before `index`."""
        for node in nodes:
            content = _of_parent(node).fields.setdefault(field, FieldContent([], bracketed=True))
            content.items[index:index] = [node]
            index += 1

    def remove(self, node: SceneNode) -> None:
        """Remove a node, and all nodes inside it, from the tree."""
        for content in _of_parent(node).fields.values():
            content.items = [item for item in content.items if item is not node]
        self.forget([node])

    def forget(self, nodes: Iterable[SceneNode]) -> None:
        """Remove nodes, and all nodes inside them, from the numbered nodes."""
        for node in nodes:
            for gone in (node, *node.descendants()):
                gone.twins.remove(gone)
                self.nodes.pop(gone.number, None)

    def field_of(self, node: SceneNode, name: str, changes: Changes) -> NodeField | None:
        """Return a node's field; None if this node type has no such field."""
        found = self._fields.get((node.number, name))
        kind = kinds_of(node).get(name) if found is None else None
        if kind is not None:
            found = self._fields[node.number, name] = NodeField(node, name, kind, changes)
        return found

    def of_def(self, path: str, within: SceneNode | None = None) -> SceneNode | None:
        """Return the first node with a DEF name, inside `within`; "ROBOT.ARM" is an ARM inside a ROBOT."""
        found: SceneNode | None = within or self.root
        for name in path.split("."):
            if found is None or not name:
                return None
            found = next(
                (descendant for descendant in found.descendants() if descendant.def_name == name), None
            )
        return found

    def of_number(self, number: int) -> SceneNode | None:
        """Return the node whose `get_id` is `number`."""
        return self.nodes.get(number)


def _of_parent(node: SceneNode) -> SceneNode:
    """Return the parent of a node that is not the root."""
    if node.parent is None:
        raise ValueError("the root of the world has no parent; change the nodes inside the root")
    return node.parent


def _mark_outlines(nodes: Iterable[SceneNode]) -> None:
    for node in nodes:
        for outline in node.nodes("boundingObject"):
            for inner in (outline, *outline.descendants()):
                for twin in inner.twins:
                    twin.outline = True
