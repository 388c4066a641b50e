"""Altimeter: the height of the sensor in the world, plus the height in WorldInfo.gpsReference.

Source: WbAltimeter.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import discrete
from palaestra_sim.scene.frames import Frame


@dataclass(slots=True, kw_only=True, eq=False)
class Altimeter:
    """An altimeter; `value` is in meters.

    Attributes:
        reference: the number of meters that is added to the sensor's height in the world.
        accuracy: standard deviation of the noise, in meters.
    """

    name: str
    model: str
    place: Frame
    reference: float
    accuracy: float
    resolution: float
    value: float = math.nan


def _read(part: DevicePart) -> Altimeter:
    return Altimeter(
        name=part.name,
        model=part.text("model"),
        place=part.place,
        reference=part.world_numbers("gpsReference", (0.0, 0.0, 0.0))[part.axis_to("U")],
        accuracy=part.number("accuracy", 0.0),
        resolution=part.number("resolution", -1.0),
    )


def _sampler(altimeters: Sequence[Altimeter], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        for altimeter in altimeters:
            height = altimeter.reference + altimeter.place.height_m
            if altimeter.accuracy:
                height += altimeter.accuracy * gauss(0.0, 1.0)
            altimeter.value = discrete(height, altimeter.resolution)

    return sample


def _topics(altimeter: Altimeter) -> tuple[DeviceTopic, ...]:
    return (DeviceTopic(name="value", type_name="webots_ros/Float64Stamped", source=altimeter),)


ALTIMETER: Final = DeviceType(
    node="Altimeter",
    name="altimeter",
    fields="accuracy SFFloat 0; resolution SFFloat -1",
    read=_read,
    sampler=_sampler,
    topics=_topics,
)
