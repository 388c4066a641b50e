"""Node types as a supervisor sees them: their fields, and the type of each field.

`node_fields` and `devices` list the fields of all base types. The fields of an older release are not listed:
such a field exists if the world file sets it, and its type is derived from its value.
"""

from __future__ import annotations

from enum import IntEnum
from functools import cache
from typing import Final, NamedTuple

from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.nodes.scene_node import FieldContent, SceneNode
from palaestra_sim.scene.tree.node_fields import NODE_FIELDS, SOLID_FIELDS


class FieldType(IntEnum):
    """The type of one value of a field; `get_type` adds 0x10 for a field of several values."""

    BOOL = 1
    INT32 = 2
    FLOAT = 3
    VEC2F = 4
    VEC3F = 5
    ROTATION = 6
    COLOR = 7
    STRING = 8
    NODE = 9


MULTIPLE: Final = 0x10
WIDTH: Final = {
    FieldType.VEC2F: 2,
    FieldType.VEC3F: 3,
    FieldType.ROTATION: 4,
    FieldType.COLOR: 3,
}
_NAMES: Final = {
    FieldType.BOOL: "Bool",
    FieldType.INT32: "Int32",
    FieldType.FLOAT: "Float",
    FieldType.VEC2F: "Vec2f",
    FieldType.VEC3F: "Vec3f",
    FieldType.ROTATION: "Rotation",
    FieldType.COLOR: "Color",
    FieldType.STRING: "String",
    FieldType.NODE: "Node",
}
_TYPES: Final = {name: type_ for type_, name in _NAMES.items()}


class FieldKind(NamedTuple):
    """The declaration of a field: its type, whether it has several values, and its default as in a world."""

    type: FieldType
    multiple: bool
    default: str = ""

    @property
    def number(self) -> int:
        """The number that `supervisor/field/get_type` returns."""
        return self.type | (MULTIPLE if self.multiple else 0)

    @property
    def name(self) -> str:
        """The name that `supervisor/field/get_type_name` returns, e.g. "SFVec3f"."""
        return ("MF" if self.multiple else "SF") + _NAMES[self.type]


_WITHOUT_EFFECT: Final = {
    "WorldInfo": "CFM ERP physics defaultDamping inkEvaporation",
    "Solid": "immersionProperties",
    "Robot": "immersionProperties selfCollision",
    "HingeJointParameters": """
        suspensionSpringConstant suspensionDampingConstant suspensionAxis stopERP stopCFM""",
    "Physics": "damping",
    "ContactProperties": """
        frictionRotation rollingFriction bounce bounceVelocity forceDependentSlip softERP softCFM""",
}


# For each field, the values that have the same effect here as in Webots.
_AS_SIMULATED: Final = {"bounce": [0.0]}


def without_effect(node: SceneNode) -> list[str]:
    """Return the fields with values other than the default that have an effect in Webots but not here."""
    kind = DEVICES.get(node.type_name)
    names = (kind.without_effect if kind else _WITHOUT_EFFECT.get(node.type_name, "")).split()
    kinds = _kinds(node.type_name)
    return [
        name for name in names if name in node.fields and not _is_plain(name, kinds[name], node.fields[name])
    ]


def _is_plain(name: str, kind: FieldKind, content: FieldContent) -> bool:
    """Return whether a field has its default, or a value for which the simulators agree with Webots."""
    items = [item for item in content.items if item not in {None, ""}]
    if items == _AS_SIMULATED.get(name):
        return True
    if kind.type in {FieldType.STRING, FieldType.NODE}:
        return items == ([kind.default] if kind.default else [])
    if kind.type is FieldType.BOOL:
        return items == [kind.default == "TRUE"]
    return items == [float(word) for word in kind.default.split()]


def field_kinds(type_name: str) -> dict[str, FieldKind]:
    """Return the fields of a node type in the order of their indices; {} for an unknown type."""
    kinds: dict[str, FieldKind] = {}
    for entry in _declared(type_name).split(";"):
        words = entry.split(maxsplit=2)
        if words:
            name, sort, *default = words
            kinds[name] = FieldKind(_TYPES[sort[2:]], sort.startswith("MF"), "".join(default))
    return kinds


def _declared(type_name: str) -> str:
    kind = DEVICES.get(type_name)
    if kind is None:
        return NODE_FIELDS.get(type_name, "")
    own = f"name SFString {kind.name}; {kind.fields}"
    return f"{SOLID_FIELDS}; {own}" if kind.body else own


def kinds_of(node: SceneNode) -> dict[str, FieldKind]:
    """Return the fields of a node in the order of their indices; fields that are not listed come last."""
    known = _kinds(node.type_name)
    return known | {name: _guessed(content) for name, content in node.fields.items() if name not in known}


@cache
def _kinds(type_name: str) -> dict[str, FieldKind]:
    return field_kinds(type_name)


def _guessed(content: FieldContent) -> FieldKind:
    """Return the kind of a field that is not listed, from its value in the world file."""
    items, bracketed = content.items, content.bracketed
    if not items or items[0] is None or isinstance(items[0], SceneNode):
        return FieldKind(FieldType.NODE, bracketed)
    if isinstance(items[0], bool):
        return FieldKind(FieldType.BOOL, bracketed)
    if isinstance(items[0], str):
        return FieldKind(FieldType.STRING, bracketed)
    if bracketed:
        return FieldKind(FieldType.FLOAT, True)
    by_width = {2: FieldType.VEC2F, 3: FieldType.VEC3F, 4: FieldType.ROTATION}
    # No single value has more numbers than a rotation, so a field with more numbers has several values.
    return FieldKind(by_width.get(len(items), FieldType.FLOAT), len(items) > max(by_width))
