"""TouchSensor: a bumper around its robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.devices.kind import Carrier, Kind, Part, Sample, Topic
from palaestra_sim.scene.shapes import Shape
from palaestra_sim.seam import Row

_BUMPER: Final = 0  # what `get_type` answers; FORCE is 1, FORCE_3D 2
_TABLE: Final = [0.0, 0.0, 0.0, 5000.0, 50000.0, 0.0]  # the default of TouchSensor.lookupTable


@dataclass(slots=True, kw_only=True, eq=False)
class TouchSensor:
    """A bumper; `value` is whether its robot touched anything since the sensor was last sampled."""

    name: str
    model: str
    outline: list[Shape]
    value: bool = False


def _read(part: Part) -> TouchSensor:
    if part.text("type", "bumper") != "bumper":
        part.lack("a touch sensor that measures force")
    # Without physics of its own, a bumper is part of the robot in Webots too.
    return TouchSensor(name=part.name, model=part.text("model"), outline=part.take_outline())


def _sampler(sensors: Sequence[TouchSensor], robot: Carrier) -> Sample:
    """Sample the bumpers that reach the robot's rim; one inside the body is never touched.

    All of them are read before the contacts are forgotten, so that each hears of its own.
    """
    body = robot.body
    if body is None:
        return lambda: None
    outer = [(sensor, bits) for sensor in sensors if (bits := body.bits(sensor.outline))]

    def sample() -> None:
        for sensor, bits in outer:
            sensor.value = bool(body.touched & bits)
        body.touched = 0

    return sample


def _services(_sensor: TouchSensor) -> tuple[Row, ...]:
    return (
        ("get_type", "get_int", lambda _: {"value": _BUMPER}),
        ("get_lookup_table", "get_float_array", lambda _: {"value": _TABLE}),
    )


def _topics(sensor: TouchSensor) -> tuple[Topic, ...]:
    return (Topic(name="value", type_name="webots_ros/BoolStamped", source=sensor),)


TOUCH_SENSOR: Final = Kind(
    node="TouchSensor",
    name="touch sensor",
    fields="type SFString bumper; lookupTable MFVec3f 0 0 0 5000 50000 0; resolution SFFloat -1",
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
