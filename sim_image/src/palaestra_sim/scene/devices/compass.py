"""Compass: the direction of north, a unit vector in the sensor's frame.

North is the axis of the world that is N in WorldInfo.coordinateSystem. Source: WbCompass.cpp and
WbWorldInfo.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from palaestra_sim.ros_interfaces import Row
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Sample
from palaestra_sim.scene.devices.sensor_response import AXES_FIELDS, Axes, read_axes
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector, transposed, turn


@dataclass(slots=True, kw_only=True, eq=False)
class Compass:
    """A compass of up to three axes; `value` is x, y, z of north in the compass's frame."""

    name: str
    model: str
    place: Frame
    axes: Axes
    north: Vector
    value: Vector = (math.nan, math.nan, math.nan)


def _read(part: DevicePart) -> Compass:
    x, y, z = (float(axis == part.axis_to("N")) for axis in range(3))
    return Compass(
        name=part.name, model=part.text("model"), place=part.place, axes=read_axes(part), north=(x, y, z)
    )


def _sampler(compasses: Sequence[Compass], robot: Carrier) -> Sample:
    gauss = robot.gauss

    def sample() -> None:
        for compass in compasses:
            north = turn(transposed(compass.place.world_pose.rotation), compass.north)
            compass.value = compass.axes.respond(north, gauss)

    return sample


def _services(compass: Compass) -> tuple[Row, ...]:
    return compass.axes.services()


def _topics(compass: Compass) -> tuple[DeviceTopic, ...]:
    type_name = "sensor_msgs/MagneticField"
    return (DeviceTopic(name="values", type_name=type_name, source=compass, reading="magnetic_field"),)


COMPASS: Final = DeviceType(
    node="Compass",
    name="compass",
    fields=AXES_FIELDS,
    read=_read,
    sampler=_sampler,
    services=_services,
    topics=_topics,
)
