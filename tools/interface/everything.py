"""A world whose supervisor has every device, and the services and topics of each simulator in this world."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Final

from palaestra_sim.faults.known_paths import KnownPaths, survey
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.devices import DEVICES
from palaestra_sim.scene.devices.device_type import DeviceType
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.physics import Physics
from palaestra_sim.stub.physics import StubPhysics

ROBOT = "everything"
_SETTINGS = {
    "Camera": "focus Focus { } zoom Zoom { } recognition Recognition { segmentation TRUE }",
    "Lidar": "numberOfLayers 1",
    "Radar": "minRadialSpeed 0 maxRadialSpeed 0 verticalFieldOfView 1",
}

_MASS = "physics Physics { density -1 mass 1 }"  # without it no force moves a joint

PHYSICS: Mapping[str, Callable[[], Physics]] = {"stub": StubPhysics, "mujoco": MujocoPhysics}
# Services that fail because a simulator cannot perform them. A success without effect would mislead a client.
_STUB = frozenset(  # pictures and forces
    (
        "camera/enable",
        "camera/recognition_enable",
        "camera/recognition_enable_segmentation",
        "camera/recognition_save_segmentation_image",
        "camera/save_image",
        "display/attach_camera",
        "linear_motor/force_feedback_sensor/enable",
        "linear_motor/set_force",
        "range_finder/enable",
        "range_finder/save_image",
        "rotational_motor/set_torque",
        "rotational_motor/torque_feedback_sensor/enable",
        "supervisor/export_image",
        "supervisor/movie_start_recording",
        "supervisor/node/add_force",
        "supervisor/node/add_force_with_offset",
        "supervisor/node/add_torque",
    )
)
_EVERYWHERE = frozenset(
    (
        "robot/get_urdf",
        "skin/get_bone_name",
        "skin/get_bone_orientation",
        "skin/get_bone_position",
        "skin/set_bone_orientation",
        "skin/set_bone_position",
        "supervisor/animation_start_recording",
        "supervisor/virtual_reality_headset_get_orientation",
        "supervisor/virtual_reality_headset_get_position",
        "supervisor/world_save",
    )
)
NOT_IN_WEBOTS: Final = frozenset(("lidar/laser_scan/layer0",))
# Services and topics whose check needs a person at the window of Webots, a gamepad, or the bones of a mesh.
# Without bones, the controller of Webots reads a null pointer.
UNCHECKED_IN_WEBOTS: Final = frozenset(
    (
        "joystick/get_number_of_axes",
        "joystick/is_connected",
        "joystick/pov0",
        *(f"joystick/axis{axis}" for axis in range(6)),
        "keyboard/key",
        "skin/get_bone_name",
        "skin/get_bone_orientation",
        "skin/get_bone_position",
        "skin/set_bone_orientation",
        "skin/set_bone_position",
    )
)
FAILING: Mapping[str, frozenset[str]] = {"stub": _EVERYWHERE | _STUB, "mujoco": _EVERYWHERE}


def device_name(type_name: str) -> str:
    """Return the name that a type's device has in the world: "distance_sensor" for "DistanceSensor"."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", "_", type_name).lower()


def world() -> str:
    """Return the text of the world file."""
    parts = "\n".join(_part(kind) for kind in DEVICES.values())
    return f"""#VRML_SIM R2023b utf8
WorldInfo {{ basicTimeStep 32 info [ "everything" ] }}
DEF VIEWPOINT Viewpoint {{ position 0 0 5 }}
DEF BOX Solid {{ translation 2 0 0.5 radarCrossSection 1 boundingObject Box {{ size 0.5 0.5 1 }} }}
DEF ROBOT Robot {{
  name "{ROBOT}" controller "ros" supervisor TRUE battery [ 100, 100, 0 ]
  controllerArgs [ "--name={ROBOT}" "--synchronize" "--clock" ]
  children [
{parts}
  ]
}}
"""


@cache
def offered(simulator: str) -> KnownPaths:
    """Return the services and topics of a simulator in that world."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "everything.wbt")
        path.write_text(world())
        return survey(Loader(physics=PHYSICS[simulator]), path)


def groups(paths: Mapping[str, str]) -> dict[str, dict[str, str]]:
    """Return paths by their owner: a type of device, "robot", "supervisor/node" and so on."""
    types = {device_name(name): name for name in DEVICES}
    found: dict[str, dict[str, str]] = {}
    for path, type_name in paths.items():
        first, _, rest = path.partition("/")
        group = types.get(first, first)
        if group == "supervisor" and rest.startswith(("node/", "field/")):
            group = f"supervisor/{rest.partition('/')[0]}"
        if not rest:
            group = "node"
        found.setdefault(group, {})[path] = type_name
    return found


def _part(kind: DeviceType[Any]) -> str:
    node = f'{kind.node} {{ name "{device_name(kind.node)}" {_SETTINGS.get(kind.node, "")} }}'
    if not kind.on_joint:
        return node
    joint = "SliderJoint" if kind.node == "LinearMotor" else "HingeJoint"
    return f"DEF {kind.node.upper()}_JOINT {joint} {{ device {node} endPoint Solid {{ {_MASS} }} }}"
