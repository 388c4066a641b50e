"""Create the scene nodes of a world from the nodes that its files contain.

Each `USE` of a node becomes a separate node, as in Webots. An instance of a PROTO becomes the node in the
PROTO's body, with the field values of the instance. This node has the DEF name of the instance, and errors
refer to the instance's position in the file.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.extrusion import faces
from palaestra_sim.scene.nodes.expansions import Expansions
from palaestra_sim.scene.nodes.scene_node import Content, FieldContent, Origin, SceneNode
from palaestra_sim.scene.nodes.scope import Scope, definitions
from palaestra_sim.scene.nodes.types import is_base_type
from palaestra_sim.world import Is, Item, Node, Proto, Value, World, builtin_protos
from palaestra_sim.world.parts import ShapePart
from palaestra_sim.world.project_files import ReadFile
from palaestra_sim.world.source import Source
from palaestra_sim.world.stand_ins import StandIn, expand

_SHAPES: Final = {
    "box": ("Box", ("size",)),
    "cylinder": ("Cylinder", ("radius", "height")),
    "sphere": ("Sphere", ("radius",)),
    "plane": ("Plane", ("size",)),
}
MAX_DEPTH: Final = 20  # levels of PROTOs inside PROTOs; Webots' own robots need three
# Limits the number of nodes: 20 levels of PROTOs that each contain the next PROTO twice make a million nodes.
MAX_NODES: Final = 250_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Descriptions:
    """The definitions of node types that are not base types, and the files that nodes name.

    Attributes:
        protos: PROTOs, by name.
        stand_ins: simple solids that replace PROTOs, by name; a stand-in overrides a PROTO of its name.
        unusable: the errors of local PROTOs that cannot be expanded, by name.
        read: returns the bytes of a file that a node names; without it, no file can be read.
    """

    protos: Mapping[str, Proto] = field(default_factory=dict)
    stand_ins: Mapping[str, StandIn] = field(default_factory=dict)
    unusable: Mapping[str, WorldError] = field(default_factory=dict)
    read: ReadFile | None = None


class Instantiator:
    """Creates nodes, and numbers them.

    Attributes:
        nodes: all nodes that were created, by their numbers.
        refused: the mistakes in the files, because of which nodes are missing.
        ignored: the fields that a PROTO does not have; Webots ignores such fields too.
    """

    def __init__(self, descriptions: Descriptions) -> None:
        self._descriptions = descriptions
        self._expansions = Expansions()
        self.nodes: dict[int, SceneNode] = {}
        self._numbers = itertools.count()
        self._twins: dict[tuple[Scope, int], list[SceneNode]] = {}
        self.refused: list[WorldError] = []
        self.ignored: list[WorldError] = []

    def root(self, world: World, name: str) -> SceneNode:
        """Return the root of a world's tree."""
        root = self._new("Group", None, None)
        scope = Scope.of(Source(data=world.source, name=name), world.nodes)
        root.fields["children"] = FieldContent(self.grow(world.nodes, scope, root), bracketed=True)
        return root

    def grow(self, written: Iterable[Node], scope: Scope, parent: SceneNode) -> list[Content]:
        """Return the scene nodes of `written` inside `parent`; record nodes with mistakes and skip them."""
        grown = (self._grow(node, scope, parent) for node in written)
        return [node for node in grown if node is not None]

    def _grow(self, written: Node, scope: Scope, parent: SceneNode) -> SceneNode | None:
        if len(self.nodes) > MAX_NODES:  # raise at once, because the rest may need all memory
            fact = f"the world has more than {MAX_NODES} nodes"
            raise scope.error(written, fact, "remove a cycle of PROTOs or of USE, or use fewer nodes")
        try:
            source = scope.resolve(written)
        except WorldError as error:
            self.refused.append(error)
            return None
        if not is_base_type(source.type_name):
            stand_in = self._descriptions.stand_ins.get(source.type_name)
            if stand_in is not None and source.text("controller") != "ros":
                return self._solid(stand_in, source, scope, parent)
            proto = self._descriptions.protos.get(source.type_name)
            if proto is not None:
                return self._instance(proto, source, scope, parent)
        return self._plain(source, scope, parent, self._descriptions.unusable.get(source.type_name))

    def _plain(self, source: Node, scope: Scope, parent: SceneNode, why: WorldError | None) -> SceneNode:
        """Return the node of a base type, or of a type that cannot be expanded; `why` has the reason."""
        node = self._new(source.type_name, Origin(source, scope.source), parent)
        node.def_name = source.def_name or ""
        if source.type_name == "Extrusion" and why is None:
            self._fill(node, source, scope)
            return self._extruded(node)
        if why is not None:
            node.unusable = f"{source.type_name} is not expanded ({why.world}:{why.line}: {why.fact})"
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
            self.refused.append(scope.error(source, fact, "remove the cycle"))
            return None
        unknown = [name for name in source.fields if name not in proto.fields and " " not in name]
        for name in unknown:
            fact = f"the PROTO {proto.name} has no field {name}"
            self.ignored.append(scope.error(source, fact, "ignored, as by Webots"))
        bindings = _bindings(proto, source, scope)
        try:
            expanded = self._expansions.of(proto, bindings)
        except WorldError as error:
            return self._plain(source, scope, parent, error)
        inner = Scope(
            source=expanded.source,
            defs=definitions((expanded.body,)),
            depth=scope.depth + 1,
            bindings=bindings,
        )
        node = self._grow(expanded.body, inner, parent)
        if node is not None:
            node.proto_name = proto.name
            node.shipped = builtin_protos().get(proto.name) is proto
            node.def_name = source.def_name or ""
            node.origin = Origin(source, scope.source)
        return node

    def _extruded(self, node: SceneNode) -> SceneNode:
        """Convert an Extrusion to an IndexedFaceSet, as Webots does; a curved Extrusion stays unchanged."""
        found = faces(
            {name: node.numbers(name) or () for name in node.fields},
            begin_cap=node.flag("beginCap", True),
            end_cap=node.flag("endCap", True),
        )
        if found is None:
            return node
        node.type_name = "IndexedFaceSet"
        node.proto_name = "Extrusion"
        points = self._new("Coordinate", node.origin, node)
        flat = [number for point in found.points for number in point]
        points.fields["point"] = FieldContent(list(flat), bracketed=True)
        ccw = node.fields.get("ccw")
        node.fields.clear()
        node.fields["coord"] = FieldContent([points])
        node.fields["coordIndex"] = FieldContent([float(it) for it in found.index], bracketed=True)
        if ccw is not None:
            node.fields["ccw"] = ccw
        return node

    def _solid(self, stand_in: StandIn, source: Node, scope: Scope, parent: SceneNode) -> SceneNode:
        """Return a Solid with the size of a PROTO's instance, and with the fields of the PROTO."""
        origin = Origin(source, scope.source)
        node = self._new("Solid", origin, parent)
        node.proto_name = stand_in.name
        node.shipped = True
        node.stand_in = True
        node.def_name = source.def_name or ""
        for name, declared in stand_in.fields.items():
            plain = [item for item in declared.default.items if not isinstance(item, Node | Is)]
            node.fields[name] = FieldContent(list(plain), bracketed=declared.default.bracketed)
        self._fill(node, source, scope)
        values = {
            name: [item for item in node.fields[name].items if not isinstance(item, SceneNode)]
            for name in stand_in.fields
        }
        outline = self._new("Group", origin, node)
        parts = [self._part(part, origin, outline) for part in expand(stand_in, values)]
        outline.fields["children"] = FieldContent(list(parts), bracketed=True)
        node.fields["boundingObject"] = FieldContent([outline])
        for name in ("physics", "children"):
            node.fields.pop(name, None)
        return node

    def _part(self, part: ShapePart, origin: Origin, parent: SceneNode) -> SceneNode:
        pose = self._new("Pose", origin, parent)
        pose.fields["translation"] = FieldContent(list(part.position))
        pose.fields["rotation"] = FieldContent([0.0, 0.0, 1.0, part.turn])
        type_name, names = _SHAPES[part.shape]
        shape = self._new(type_name, origin, pose)
        if len(names) == 1:
            shape.fields[names[0]] = FieldContent(list(part.size))
        else:
            shape.fields.update(zip(names, (FieldContent([number]) for number in part.size), strict=True))
        pose.fields["children"] = FieldContent([shape], bracketed=True)
        return pose

    def _new(self, type_name: str, origin: Origin | None, parent: SceneNode | None) -> SceneNode:
        node = SceneNode(next(self._numbers), type_name, origin, parent)
        self.nodes[node.number] = node
        return node

    def _refuse_unknown(self, value: Value, source: Node, scope: Scope) -> None:
        (bound,) = value.items
        name = getattr(bound, "name", "")
        fact = f"{source.type_name} has IS {name}, but the PROTO has no field {name}"
        self.refused.append(scope.error(source, fact, "declare it in the head of the PROTO"))


def _bindings(proto: Proto, instance: Node, scope: Scope) -> dict[str, tuple[Value, Scope]]:
    """Return the value of each field of a PROTO: the value in the instance, else the default."""
    defaults = [item for it in proto.fields.values() for item in it.default.items if isinstance(item, Node)]
    own = Scope(source=proto.source, defs=definitions(defaults), depth=scope.depth + 1)
    return {
        name: (instance.fields[name], scope) if name in instance.fields else (declared.default, own)
        for name, declared in proto.fields.items()
    }
