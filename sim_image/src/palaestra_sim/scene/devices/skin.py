"""Skin: meshes are not loaded, so a skin has no bones here; each service that needs a bone fails."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.ros_interfaces import Handler, Row, UnsimulatedError
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceType


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Skin:
    """A skin without bones."""

    name: str
    model: str


def _read(part: DevicePart) -> Skin:
    return Skin(name=part.name, model=part.text("model"))


def _without_bones(name: str) -> Handler:
    # Webots dereferences a null pointer for the name or the position of a bone that does not exist.
    def fail(request: Any) -> dict[str, Any]:
        raise UnsimulatedError(
            f"{name} has no bone {request.index}, because this simulator does not load the meshes of skins"
        )

    return fail


def _services(skin: Skin) -> tuple[Row, ...]:
    missing = _without_bones(skin.name)
    return (
        ("get_bone_count", "get_int", lambda _: {"value": 0}),
        ("get_bone_name", "skin_get_bone_name", missing),
        ("get_bone_orientation", "skin_get_bone_orientation", missing),
        ("get_bone_position", "skin_get_bone_position", missing),
        ("set_bone_orientation", "skin_set_bone_orientation", lambda _: {"success": 0}),
        ("set_bone_position", "skin_set_bone_position", lambda _: {"success": 0}),
    )


SKIN: Final = DeviceType(
    node="Skin",
    name="skin",
    without_effect="modelUrl appearance bones castShadows",
    fields="""translation SFVec3f 0 0 0; rotation SFRotation 0 0 1 0; scale SFVec3f 1 1 1; modelUrl SFString;
        appearance MFNode; bones MFNode; castShadows SFBool TRUE; translationStep SFFloat 0.01;
        rotationStep SFFloat 0.261799387""",
    solid=False,
    read=_read,
    services=_services,
)
