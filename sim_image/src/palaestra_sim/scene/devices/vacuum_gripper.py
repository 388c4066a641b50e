"""VacuumGripper: holding is not simulated, so a gripper that could hold an object cannot be switched on.

In Webots a gripper holds an object that touches its boundingObject. A gripper without a boundingObject never
holds an object, so it can be switched on here too.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row, UnsimulatedError
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceTopic, DeviceType


@dataclass(slots=True, kw_only=True, eq=False)
class VacuumGripper:
    """A gripper.

    Attributes:
        on: whether the gripper is switched on.
        touches: whether an object could touch the gripper, which would then hold the object.
        value: whether the gripper holds an object.
    """

    name: str
    model: str
    on: bool
    touches: bool
    value: bool = False

    def turn(self, *, on: bool) -> None:
        """Switch the gripper on or off.

        Raises:
            UnsimulatedError: the gripper could hold an object.
        """
        if on and self.touches:
            raise UnsimulatedError(
                f"{self.name} has a boundingObject, and holding objects that touch it is not simulated;"
                " use driver webots"
            )
        self.on = on


def _read(part: DevicePart) -> VacuumGripper:
    on, touches = part.node.flag("isOn", False), bool(part.node.nodes("boundingObject"))
    if on and touches:
        part.lack("a VacuumGripper that holds objects that touch it")
    return VacuumGripper(name=part.name, model=part.text("model"), on=on, touches=touches)


def _services(gripper: VacuumGripper) -> tuple[Row, ...]:
    def turn_on(request: Any) -> Fields:
        gripper.turn(on=request.value)
        return {"success": True}

    return (
        ("turn_on", "set_bool", turn_on),
        ("is_on", "get_bool", lambda _: {"value": gripper.on}),
    )


def _topics(gripper: VacuumGripper) -> tuple[DeviceTopic, ...]:
    return (DeviceTopic(name="presence", type_name="webots_ros/BoolStamped", source=gripper),)


VACUUM_GRIPPER: Final = DeviceType(
    node="VacuumGripper",
    name="vacuum gripper",
    without_effect="tensileStrength shearStrength",
    fields="isOn SFBool FALSE; tensileStrength SFFloat -1; shearStrength SFFloat -1",
    read=_read,
    services=_services,
    topics=_topics,
    sensor="presence_sensor",
)
