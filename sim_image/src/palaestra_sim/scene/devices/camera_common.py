"""The common parts of Camera and RangeFinder: the lens, the topic of images, and the service to save them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Handler
from palaestra_sim.scene import picture_files
from palaestra_sim.scene.camera_interface import MOST_PIXELS, Lens
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceTopic, ValueSource

PIXEL_BYTES: Final = 4  # a color and a distance both have this size


def read_lens(part: DevicePart, near_m: float, far_m: float) -> Lens:
    """Return the lens of a device; too few or too many pixels are a mistake in the world."""
    width, height = int(part.number("width", 64.0)), int(part.number("height", 64.0))
    if not 0 < width <= MOST_PIXELS or not 0 < height <= MOST_PIXELS:
        part.refuse(f"a {part.node.type_name} of {width} by {height} pixels", f"use 1 to {MOST_PIXELS}")
        width = height = 1
    return Lens(
        size=(width, height),
        field_of_view_rad=part.number("fieldOfView", 0.7854),
        near_m=near_m,
        far_m=far_m,
    )


def picture_topic(
    name: str, source: ValueSource, lens: Lens, encoding: str, *, many: bool = False
) -> DeviceTopic:
    """Return the topic of images with four bytes per pixel."""
    width, height = lens.size
    constants = {"height": height, "width": width, "encoding": encoding, "step": PIXEL_BYTES * width}
    return DeviceTopic(
        name=name,
        type_name="sensor_msgs/Image",
        source=source,
        constants=constants,
        reading="data",
        many=many,
    )


@dataclass(frozen=True, slots=True)
class _Projection:
    """The projection of a lens; `value` has the fields of sensor_msgs/CameraInfo.

    Source: RosRangeFinder.cpp of Webots.
    """

    lens: Lens

    @property
    def value(self) -> Fields:
        width, height = self.lens.size
        focal = width / (2.0 * math.tan(self.lens.field_of_view_rad / 2.0))
        center_x, center_y = (width + 1.0) / 2.0, (height + 1.0) / 2.0
        return {
            "height": height,
            "width": width,
            "K": (focal, 0.0, center_x, 0.0, focal, center_y, 0.0, 0.0, 1.0),
            "R": (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
            "P": (focal, 0.0, center_x, 0.0, 0.0, focal, center_y, 0.0, 0.0, 0.0, 1.0, 0.0),
        }


def projection_topic(lens: Lens) -> DeviceTopic:
    """Return the topic of the projection, which ROS's tools for images need."""
    return DeviceTopic(
        name="camera_info", type_name="sensor_msgs/CameraInfo", source=_Projection(lens), whole=True
    )


def saver(lens: Lens, silent: Callable[[], bool], pixels: Callable[[], bytes | memoryview]) -> Handler:
    """Return a handler that saves an image; while the device is silent, it returns failure."""

    def save_image(request: Any) -> Fields:
        saved = not silent() and picture_files.save(
            request.filename, lens.size, pixels(), quality=request.quality
        )
        return {"success": int(saved)}

    return save_image
