"""The devices that every robot has in its controller and none in the world: battery, keyboard, joystick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palaestra_sim.stub.scene.devices.kind import Enable, Topic, whole_steps
from palaestra_sim.stub.seam import UnsimulatedError


@dataclass(frozen=True, slots=True, kw_only=True)
class PseudoDevice:
    """A row of the table of these: name, topics and rule of `enable`, as in `Kind`."""

    name: str
    topics: tuple[Topic, ...] = ()
    enable: Enable = whole_steps


@dataclass(slots=True)
class _Battery:
    """The battery of a robot that has none."""

    value: float = -1.0


def _no_joystick(_period_ms: int, _step_ms: int) -> bool:
    raise UnsimulatedError("the stub has no joystick; use driver webots, or publish it yourself")


PSEUDO_DEVICES: Final = (
    PseudoDevice(
        name="battery_sensor",
        topics=(Topic(name="value", type_name="webots_ros/Float64Stamped", source=_Battery()),),
    ),
    PseudoDevice(
        name="keyboard", topics=(Topic(name="key", type_name="webots_ros/Int32Stamped", source=None),)
    ),
    PseudoDevice(name="joystick", enable=_no_joystick),
)
