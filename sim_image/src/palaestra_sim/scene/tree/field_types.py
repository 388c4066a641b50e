"""Node types as a supervisor sees them: their fields, and the type of each field.

The fields and defaults come from resources/nodes/*.wrl of Webots R2023b. This module lists only the types in
the stub's worlds; `devices` lists the types of devices. A field that is not listed exists if the world file
sets it, and its type is derived from its value.
"""

from __future__ import annotations

from enum import IntEnum
from functools import cache
from typing import Final, NamedTuple

from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.nodes.scene_node import FieldContent, SceneNode


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


_POSE = """
translation SFVec3f 0 0 0; rotation SFRotation 0 0 1 0; children MFNode;
translationStep SFFloat 0.01; rotationStep SFFloat 0.261799387
"""
_SOLID = f"""{_POSE};
name SFString solid; model SFString; description SFString; contactMaterial SFString default;
immersionProperties MFNode; boundingObject SFNode; physics SFNode; locked SFBool FALSE;
radarCrossSection SFFloat 0; recognitionColors MFColor
"""
_LIGHT = """
ambientIntensity SFFloat 0; color SFColor 1 1 1; intensity SFFloat 1; on SFBool TRUE;
castShadows SFBool FALSE
"""
_FIELDS: Final = {
    "WorldInfo": """
        info MFString; title SFString; window SFString; gravity SFFloat 9.81; CFM SFFloat 0.00001;
        ERP SFFloat 0.2; physics SFString; basicTimeStep SFFloat 32; FPS SFFloat 60;
        optimalThreadCount SFInt32 1; physicsDisableTime SFFloat 1;
        physicsDisableLinearThreshold SFFloat 0.01; physicsDisableAngularThreshold SFFloat 0.01;
        defaultDamping SFNode; inkEvaporation SFFloat 0; coordinateSystem SFString ENU;
        gpsCoordinateSystem SFString local; gpsReference SFVec3f 0 0 0; lineScale SFFloat 0.1;
        dragForceScale SFFloat 30; dragTorqueScale SFFloat 5; randomSeed SFInt32 0;
        contactProperties MFNode""",
    "Viewpoint": """
        fieldOfView SFFloat 0.785398; orientation SFRotation 0 0 1 0; position SFVec3f 0 0 0;
        description SFString; near SFFloat 0.05; far SFFloat 0; exposure SFFloat 1; follow SFString;
        followType SFString Tracking Shot; followSmoothness SFFloat 0.5; lensFlare SFNode;
        ambientOcclusionRadius SFFloat 2; bloomThreshold SFFloat -1""",
    "Background": "skyColor MFColor; luminosity SFFloat 1",
    "DirectionalLight": f"{_LIGHT}; direction SFVec3f 0 0 -1",
    "PointLight": f"{_LIGHT}; attenuation SFVec3f 1 0 0; location SFVec3f 0 0 0; radius SFFloat 100",
    "Group": "children MFNode",
    "Pose": _POSE,
    "Transform": f"{_POSE}; scale SFVec3f 1 1 1",
    "Solid": _SOLID,
    "Robot": f"""{_SOLID};
        name SFString robot; controller SFString <generic>; controllerArgs MFString;
        customData SFString; supervisor SFBool FALSE; synchronization SFBool TRUE; battery MFFloat;
        cpuConsumption SFFloat 10; selfCollision SFBool FALSE; window SFString <generic>;
        remoteControl SFString <none>""",
    "HingeJoint": "jointParameters SFNode; device MFNode; endPoint SFNode; position SFFloat 0",
    "HingeJointParameters": """
        position SFFloat 0; axis SFVec3f 1 0 0; anchor SFVec3f 0 0 0; minStop SFFloat 0;
        maxStop SFFloat 0; springConstant SFFloat 0; dampingConstant SFFloat 0;
        staticFriction SFFloat 0; suspensionSpringConstant SFFloat 0;
        suspensionDampingConstant SFFloat 0; suspensionAxis SFVec3f 1 0 0; stopERP SFFloat -1;
        stopCFM SFFloat -1""",
    "Physics": """
        density SFFloat 1000; mass SFFloat -1; centerOfMass MFVec3f; inertiaMatrix MFVec3f;
        damping SFNode""",
    "ContactProperties": """
        material1 SFString default; material2 SFString default; coulombFriction MFFloat 1;
        frictionRotation SFVec2f 0 0; rollingFriction SFVec3f 0 0 0; bounce SFFloat 0.5;
        bounceVelocity SFFloat 0.01; forceDependentSlip MFFloat; softERP SFFloat 0.2;
        softCFM SFFloat 0.001""",
    "Shape": """
        appearance SFNode; geometry SFNode; castShadows SFBool TRUE; isPickable SFBool TRUE""",
    "PBRAppearance": """
        baseColor SFColor 1 1 1; transparency SFFloat 0; roughness SFFloat 0; metalness SFFloat 1;
        name SFString PBRAppearance""",
    "Box": "size SFVec3f 0.1 0.1 0.1",
    "Cylinder": """
        bottom SFBool TRUE; height SFFloat 2; radius SFFloat 1; side SFBool TRUE; top SFBool TRUE;
        subdivision SFInt32 36""",
    "Plane": "size SFVec2f 1 1",
}

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
        return _FIELDS.get(type_name, "")
    own = f"name SFString {kind.name}; {kind.fields}"
    return f"{_SOLID}; {own}" if kind.body else own


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
