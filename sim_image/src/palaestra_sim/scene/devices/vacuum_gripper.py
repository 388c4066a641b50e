"""VacuumGripper: the stub lifts nothing, so everything that would turn it on answers failure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.devices.kind import Kind, Part, Topic, always_silent
from palaestra_sim.seam import Row


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class VacuumGripper:
    """A gripper that grips nothing."""

    name: str
    model: str


def _read(part: Part) -> VacuumGripper:
    return VacuumGripper(name=part.name, model=part.text("model"))


def _services(_gripper: VacuumGripper) -> tuple[Row, ...]:
    return (
        ("turn_on", "set_bool", lambda request: {"success": not request.value}),
        ("is_on", "get_bool", lambda _: {"value": False}),
    )


def _topics(_gripper: VacuumGripper) -> tuple[Topic, ...]:
    return (Topic(name="presence", type_name="webots_ros/BoolStamped", source=None),)


VACUUM_GRIPPER: Final = Kind(
    node="VacuumGripper",
    name="vacuum gripper",
    fields="isOn SFBool FALSE; tensileStrength SFFloat -1; shearStrength SFFloat -1",
    read=_read,
    services=_services,
    topics=_topics,
    silent=always_silent,
    sensor="presence_sensor",
)
