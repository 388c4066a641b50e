"""LED: a light that the robot's program sets; cameras do not see it here."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceType


@dataclass(slots=True, kw_only=True, eq=False)
class Led:
    """An LED; `state` is 0 for off, else the number of a color, or a color if the LED is gradual."""

    name: str
    model: str
    state: int = 0


def _read(part: DevicePart) -> Led:
    return Led(name=part.name, model=part.text("model"))


def _services(led: Led) -> tuple[Row, ...]:
    def set_led(request: Any) -> Fields:
        led.state = request.value
        return {"success": True}

    return (
        ("set_led", "set_int", set_led),
        ("get_led", "get_int", lambda _: {"value": led.state}),
    )


LED: Final = DeviceType(
    node="LED",
    name="led",
    without_effect="color gradual",
    fields="color MFColor 1 0 0; gradual SFBool FALSE",
    read=_read,
    services=_services,
)
