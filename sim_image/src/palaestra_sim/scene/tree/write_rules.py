"""Refuse writes of fields that have an effect in Webots but not here.

Without these checks, a client that randomizes a world would read back the values that it wrote, but train in
a world that never changes.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Final

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.nodes.scene_node import SceneNode

# In Webots, nodes of these base types affect only how things look, and the pictures and rays here take these
# nodes into account. A write to a node of another base type changes what moves or what a sensor measures. A
# part of a boundingObject has rules of its own.
_DRAWN: Final = frozenset(
    (
        *("Appearance", "Background", "Billboard", "Box", "CadShape", "Capsule", "Color", "Cone"),
        *(
            "Coordinate",
            "Cylinder",
            "DirectionalLight",
            "ElevationGrid",
            "Fog",
            "ImageTexture",
            "IndexedFaceSet",
        ),
        *("IndexedLineSet", "LensFlare", "Material", "Mesh", "Muscle", "Normal", "PBRAppearance", "Plane"),
        *("PointLight", "PointSet", "Shape", "Sphere", "SpotLight", "TextureCoordinate", "TextureTransform"),
        "Viewpoint",
    )
)
# Fields that only people and the recognition of cameras read. `name` is one of these fields, because a
# running controller has already read the names of its devices.
_FOR_PEOPLE: Final = frozenset(("description", "info", "model", "name", "recognitionColors", "title"))
_ELSEWHERE: Final = "change the world file, or use driver webots"
_HOLDING: Final = frozenset(("Group", "Pose", "Transform"))  # these nodes act only through their children
_PLACING: Final = frozenset(("translation", "rotation"))
_SIZES: Final = {
    "Box": ("size",),
    "Capsule": ("height", "radius"),
    "Cylinder": ("height", "radius"),
    "Sphere": ("radius",),
}
_MOUNTED: Final = frozenset(kind.node for kind in DEVICES.values() if not kind.on_joint)


def require_effect(node: SceneNode, field: str) -> None:
    """Check that a write of the node's field `field` has the same effect as in Webots.

    Raises:
        UnsimulatedError: the write would have no effect.
    """
    if node.outline:
        takes_effect = resizes(node, field)
    else:
        takes_effect = _is_drawn_only(node, field) or _reaches_robot(node, field) or _moves(node, field)
    if not takes_effect:
        part = " of a boundingObject" if node.outline else ""
        raise UnsimulatedError(
            f"{node.type_name}.{field}{part} cannot be changed while the simulator runs; {_ELSEWHERE}"
        )


def require_admitted(node: SceneNode, field: str, value: object) -> None:
    """Check that the node can have that value; a robot that drives is always upright.

    Raises:
        UnsimulatedError: the node cannot have the value.
    """
    if field != "rotation" or not isinstance(value, tuple):
        return
    if any(it.place is not None and not it.place.admits(value) for it in node.twins):
        raise UnsimulatedError(
            f"{node.type_name}.rotation: this rotation tilts a robot that drives, and such a robot is always "
            "upright here; turn it about the vertical axis only, or use driver webots"
        )


def require_room(node: SceneNode, field: str, added: Sequence[SceneNode]) -> None:
    """Check that nodes, added to the node's field `field`, have the same effect as in Webots.

    Raises:
        UnsimulatedError: the effect would differ.
    """
    where = f"{node.type_name}.{field}"
    if node.outline or len(node.twins) > 1:
        part = "part of a boundingObject" if node.outline else "used several times (USE)"
        raise UnsimulatedError(f"nothing can be added to {where}, which is {part}; {_ELSEWHERE}")
    # The simulation reads the boundingObject of a Solid once, so a new one would not become an obstacle.
    outline = field == "boundingObject"
    if not any(outline or _acts(inside) for it in added for inside in (it, *it.descendants())):
        return
    if node.type_name == "Robot" or _is_carried(node) or _moves_by_itself(node):
        raise UnsimulatedError(
            f"a {added[0].type_name} that affects the simulation cannot be added to a robot, or to a Solid"
            f" that moves; {_ELSEWHERE}"
        )
    if field != "children":
        raise UnsimulatedError(
            f"a {added[0].type_name} that affects the simulation cannot be added to {where}; {_ELSEWHERE}"
        )
    _require_no_client(added, "added")


def require_removable(node: SceneNode) -> None:
    """Check that a removal of the node has the same effect as in Webots.

    Raises:
        UnsimulatedError: the effect would differ.
    """
    if node.parent is None or node.type_name in {"WorldInfo", "Viewpoint"}:
        raise UnsimulatedError(f"the {node.type_name} of a world cannot be removed; keep it")
    if node.outline:
        raise UnsimulatedError(f"no part of a boundingObject can be removed; {_ELSEWHERE}")
    if _is_carried(node) and any(_acts(it) for it in (node, *node.descendants())):
        raise UnsimulatedError(
            f"a {node.type_name} that affects the simulation cannot be removed from a robot, or from a Solid"
            f" that moves; {_ELSEWHERE}"
        )
    _require_no_client([node], "removed")


def _require_no_client(nodes: Iterable[SceneNode], done: str) -> None:
    for node in nodes:
        for inside in (node, *node.descendants()):
            if inside.type_name == "Robot" and inside.text("controller") == "ros":
                raise UnsimulatedError(
                    f"a robot with the controller ros cannot be {done} while the simulator runs; {_ELSEWHERE}"
                )


def _acts(node: SceneNode) -> bool:
    return node.type_name not in _DRAWN and node.type_name not in _HOLDING


def resizes(node: SceneNode, field: str) -> bool:
    """Return whether a write changes the size of an obstacle that stands."""
    return field in _SIZES.get(node.type_name, ()) and not any(_is_carried(twin) for twin in node.twins)


def _is_drawn_only(node: SceneNode, field: str) -> bool:
    return node.type_name in _DRAWN or field in _FOR_PEOPLE


def _reaches_robot(node: SceneNode, field: str) -> bool:
    return node.type_name == "Robot" and field in {"battery", "customData"}


def _moves(node: SceneNode, field: str) -> bool:
    """Return whether writing the field moves the node.

    A device, a shape or a mass on a robot or on a Solid that moves cannot be moved, because the physics reads
    its pose once.
    """
    if field not in _PLACING or node.place is None or not node.place.placeable:
        return False
    if node.type_name == "Robot" or not _is_carried(node):
        return True
    return not any(
        it.type_name in _MOUNTED or it.nodes("boundingObject") or it.nodes("physics")
        for it in (node, *node.descendants())
    )


def _is_carried(node: SceneNode) -> bool:
    """Return whether a node is inside a robot, or inside a Solid that moves by itself."""
    return any(around.type_name == "Robot" or _moves_by_itself(around) for around in node.ancestors())


def _moves_by_itself(node: SceneNode) -> bool:
    return node.place is not None and node.place.moves
