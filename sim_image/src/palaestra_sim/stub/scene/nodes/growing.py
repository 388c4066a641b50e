"""Grow the tree of a world: from the nodes of files to nodes that live.

A node that is `USE`d becomes a node of its own, as in Webots. An instance of a PROTO becomes the PROTO's
node, with the values of the instance. It keeps the DEF name and the place in the file of the instance.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.stub.scene.nodes.scene_node import Content, FieldContent, Origin, SceneNode
from palaestra_sim.stub.scene.nodes.scope import Scope, definitions
from palaestra_sim.stub.scene.nodes.types import is_base_type
from palaestra_sim.world import Is, Item, Node, Proto, Value, World
from palaestra_sim.world.source import Source

MAX_DEPTH: Final = 20  # of PROTOs inside PROTOs; Webots' own robots have three


@dataclass(frozen=True, slots=True, kw_only=True)
class Descriptions:
    """What types of nodes mean that are no base types.

    Attributes:
        protos: PROTOs without templates, by name.
    """

    protos: Mapping[str, Proto] = field(default_factory=dict)


class Grower:
    """Makes nodes, and numbers them.

    Attributes:
        nodes: all nodes, by number.
        refused: mistakes that were found.
    """

    def __init__(self, descriptions: Descriptions) -> None:
        self._descriptions = descriptions
        self.nodes: list[SceneNode] = []
        self._twins: dict[tuple[Scope, int], list[SceneNode]] = {}
        self.refused: list[WorldError] = []

    def root(self, world: World, name: str) -> SceneNode:
        """Return the root of a world's tree."""
        root = self._new("Group", None, None)
        scope = Scope.of(Source(data=world.source, name=name), world.nodes)
        root.fields["children"] = FieldContent(self.grow(world.nodes, scope, root), bracketed=True)
        return root

    def grow(self, written: Iterable[Node], scope: Scope, parent: SceneNode) -> list[Content]:
        """Return the nodes for `written`, inside `parent`; one with a mistake is noted and missing."""
        grown = (self._grow(node, scope, parent) for node in written)
        return [node for node in grown if node is not None]

    def _grow(self, written: Node, scope: Scope, parent: SceneNode) -> SceneNode | None:
        try:
            source = scope.resolve(written)
        except WorldError as error:
            self.refused.append(error)
            return None
        proto = self._descriptions.protos.get(source.type_name)
        if proto is not None and not is_base_type(source.type_name):
            return self._instance(proto, source, scope, parent)
        node = self._new(source.type_name, Origin(source, scope.source), parent)
        node.def_name = source.def_name or ""
        node.twins = self._twins.setdefault((scope, source.span[0]), [])
        node.twins.append(node)
        self._fill(node, source, scope)
        return node

    def _fill(self, node: SceneNode, source: Node, scope: Scope) -> None:
        for name, value in source.fields.items():
            found = scope.value(value)
            if found is None:
                self._refuse_unknown(value, source, scope)
                continue
            content = FieldContent([], bracketed=found[0].bracketed)
            node.fields[name] = content
            for item in found[0].items:
                content.items += self._content(item, found[1], node)

    def _content(self, item: Item, scope: Scope, parent: SceneNode) -> list[Content]:
        if isinstance(item, Node):
            return self.grow((item,), scope, parent)
        return [] if isinstance(item, Is) else [item]

    def _instance(self, proto: Proto, source: Node, scope: Scope, parent: SceneNode) -> SceneNode | None:
        if scope.depth >= MAX_DEPTH:
            fact = f"PROTOs are nested more than {MAX_DEPTH} deep"
            self.refused.append(scope.error(source, fact, "break the circle"))
            return None
        unknown = [name for name in source.fields if name not in proto.fields and " " not in name]
        for name in unknown:
            fact = f"the PROTO {proto.name} has no field {name}"
            self.refused.append(scope.error(source, fact, "remove it, or add the field to the PROTO"))
        inner = Scope(
            source=proto.source,
            defs=definitions((proto.body,)),
            depth=scope.depth + 1,
            bindings=_bindings(proto, source, scope),
        )
        node = self._grow(proto.body, inner, parent)
        if node is not None:
            node.proto_name = proto.name
            node.def_name = source.def_name or ""
            node.origin = Origin(source, scope.source)
        return node

    def _new(self, type_name: str, origin: Origin | None, parent: SceneNode | None) -> SceneNode:
        node = SceneNode(len(self.nodes), type_name, origin, parent)
        self.nodes.append(node)
        return node

    def _refuse_unknown(self, value: Value, source: Node, scope: Scope) -> None:
        (bound,) = value.items
        fact = (
            f"{source.type_name} has a field IS {getattr(bound, 'name', '')}, which the PROTO does not have"
        )
        self.refused.append(scope.error(source, fact, "declare it in the head of the PROTO"))


def _bindings(proto: Proto, instance: Node, scope: Scope) -> dict[str, tuple[Value, Scope]]:
    """Return the value of each of a PROTO's fields: the instance's, else the default."""
    defaults = [item for it in proto.fields.values() for item in it.default.items if isinstance(item, Node)]
    own = Scope(source=proto.source, defs=definitions(defaults), depth=scope.depth + 1)
    return {
        name: (instance.fields[name], scope) if name in instance.fields else (declared.default, own)
        for name, declared in proto.fields.items()
    }
