"""Refuse writes of fields that have an effect in Webots but none in the stub.

Otherwise a client that randomizes a world would read back its writes, but train in a world that stays the
same.
"""

from __future__ import annotations

from typing import Final

from palaestra_sim.stub.scene.devices import DEVICES
from palaestra_sim.stub.scene.joints import JointPlace
from palaestra_sim.stub.scene.nodes.scene_node import SceneNode
from palaestra_sim.stub.seam import UnsimulatedError

# Nodes that act on the physics. All others are drawn only, unless they are part of a boundingObject.
_ACTING: Final = DEVICES.keys() | frozenset(
    (
        "ContactProperties",
        "Group",
        "HingeJoint",
        "HingeJointParameters",
        "Physics",
        "Pose",
        "Robot",
        "Solid",
        "Track",
        "Transform",
        "WorldInfo",
    )
)
_FOR_PEOPLE: Final = frozenset(("description", "info", "model", "recognitionColors", "title"))
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
        UnsimulatedError: it would have no effect.
    """
    if node.outline:
        takes_effect = resizes(node, field)
    else:
        takes_effect = _is_drawn_only(node, field) or _reaches_robot(node, field) or _moves(node, field)
    if not takes_effect:
        part = " of a boundingObject" if node.outline else ""
        raise UnsimulatedError(
            f"the stub cannot change {node.type_name}.{field}{part} while it runs;"
            " write it into the world file, or use driver webots"
        )


def resizes(node: SceneNode, field: str) -> bool:
    """Return whether a write changes the size of a standing obstacle, and of nothing on a robot."""
    return field in _SIZES.get(node.type_name, ()) and not any(_on_robot(twin) for twin in node.twins)


def _is_drawn_only(node: SceneNode, field: str) -> bool:
    return node.type_name not in _ACTING or field in _FOR_PEOPLE


def _reaches_robot(node: SceneNode, field: str) -> bool:
    return node.type_name == "Robot" and field in {"battery", "customData"}


def _moves(node: SceneNode, field: str) -> bool:
    """Return whether a write of a node's place moves it; rays and outlines of a robot do not move."""
    if field not in _PLACING or node.place is None or isinstance(node.place, JointPlace):
        return False
    if node.type_name == "Robot" or not _on_robot(node):
        return True
    return not any(it.type_name in _MOUNTED for it in (node, *node.descendants()))


def _on_robot(node: SceneNode) -> bool:
    return any(around.type_name == "Robot" for around in node.ancestors())
