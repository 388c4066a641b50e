"""Brake: the damping of a joint; the damping limits the speed of the joint's motor.

The torque of a damper is its constant times the speed of the shaft. So the speed of a motor is at most its
maximum torque divided by the constant. A joint without a motor moves only in a physics with forces.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceType, Shaft


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Brake:
    """A brake on a joint."""

    name: str
    model: str
    shaft: Shaft


def _read(part: DevicePart) -> Brake:
    return Brake(name=part.name, model=part.text("model"), shaft=part.shaft or Shaft())


def _services(brake: Brake) -> tuple[Row, ...]:
    def set_damping_constant(request: Any) -> Fields:
        joint = brake.shaft.joint
        if brake.shaft.motor is not None:
            brake.shaft.motor.set_damping(request.value)
        elif joint is not None and request.value >= 0.0:
            joint.brake = request.value
        return {"success": True}

    return (
        ("set_damping_constant", "set_float", set_damping_constant),
        ("get_type", "get_int", lambda _: {"value": brake.shaft.type_number}),
    )


BRAKE: Final = DeviceType(node="Brake", name="brake", fields="", role="brake", read=_read, services=_services)
