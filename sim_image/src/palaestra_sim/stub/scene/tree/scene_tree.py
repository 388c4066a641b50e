"""The tree of a world that is loaded: nodes found by DEF or number, and their fields."""

from __future__ import annotations

from palaestra_sim.errors import WorldError
from palaestra_sim.stub.scene.nodes.growing import Descriptions, Grower
from palaestra_sim.stub.scene.nodes.scene_node import SceneNode
from palaestra_sim.stub.scene.tree.catalogue import kinds_of
from palaestra_sim.stub.scene.tree.fields import Changes, Field
from palaestra_sim.world import World


class SceneTree:
    """All nodes of one load of a world.

    Args:
        world: as read.
        name: of its file, in errors.
        descriptions: of the types that are no base types.

    Attributes:
        source: the bytes of the world.
        nodes: by number.
        root: a Group that has the nodes of the file as its children.
        refused: mistakes in the file that make a node impossible, such as `USE` of a missing name.
    """

    def __init__(self, world: World, name: str = "world", descriptions: Descriptions | None = None) -> None:
        self.source = world.source
        grower = Grower(descriptions or Descriptions())
        self.root = grower.root(world, name)
        self.nodes: list[SceneNode] = grower.nodes
        self.refused: list[WorldError] = grower.refused
        self._fields: dict[tuple[int, str], Field] = {}
        for node in self.nodes:
            for outline in node.nodes("boundingObject"):
                for inner in (outline, *outline.descendants()):
                    for twin in inner.twins:
                        twin.outline = True

    def field_of(self, node: SceneNode, name: str, changes: Changes) -> Field | None:
        """Return a node's field; None if a node of this type has none of that name."""
        found = self._fields.get((node.number, name))
        kind = kinds_of(node).get(name) if found is None else None
        if kind is not None:
            found = self._fields[node.number, name] = Field(node, name, kind, changes)
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
