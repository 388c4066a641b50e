"""Pen: the state and the ink of a pen. No lines are drawn, because only people and cameras see them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceType


@dataclass(slots=True, kw_only=True, eq=False)
class Pen:
    """A pen; `ink` is its color as 0xRRGGBB, and the density from 0 to 1."""

    name: str
    model: str
    writes: bool
    ink: tuple[int, float] = (0, 0.5)


def _read(part: DevicePart) -> Pen:
    return Pen(name=part.name, model=part.text("model"), writes=part.node.flag("write", True))


def _services(pen: Pen) -> tuple[Row, ...]:
    def write(request: Any) -> Fields:
        pen.writes = request.value
        return {"success": True}

    def set_ink_color(request: Any) -> Fields:
        pen.ink = request.color, request.density
        return {"success": 1}

    return (("write", "set_bool", write), ("set_ink_color", "pen_set_ink_color", set_ink_color))


PEN: Final = DeviceType(
    node="Pen",
    name="pen",
    without_effect="inkColor inkDensity leadSize maxDistance",
    fields="""inkColor SFColor 0 0 0; inkDensity SFFloat 0.5; leadSize SFFloat 0.002; maxDistance SFFloat 0;
        write SFBool TRUE""",
    read=_read,
    services=_services,
)
