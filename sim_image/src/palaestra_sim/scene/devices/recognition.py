"""The objects that a camera recognizes: solids with `recognitionColors` that are at least partly visible.

The position of an object is the position of its solid, in the frame of the camera. The position of an object
in the image is the middle of the rectangle around the object's visible part. The segmentation image shows
each object in its first color, on black.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.camera_interface import CameraInterface, Corners, Lens
from palaestra_sim.scene.devices.camera_common import picture_topic, saver
from palaestra_sim.scene.devices.device_type import DevicePart, DeviceTopic, Stream
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose, to_quaternion
from palaestra_sim.scene.nodes.scene_node import SceneNode

_BYTE = 255
_CHANNELS = 3


@dataclass(slots=True, kw_only=True, eq=False)
class Recognition:
    """The Recognition node of a camera.

    Attributes:
        place, lens: the frame and the lens of the camera.
        reach_m: the maximum distance of a recognized object, in meters.
        most: maximum number of objects, the nearest first; -1 for all.
        segments: whether the field `segmentation` is TRUE.
        segmenting: whether the segmentation image is published.
        eye: the camera interface; None if the simulator does not render.
    """

    place: Frame
    lens: Lens
    reach_m: float
    most: int
    segments: bool
    segmenting: bool = False
    eye: CameraInterface | None = None

    @property
    def value(self) -> list[Fields]:
        """The objects that are visible now, as messages."""
        if self.eye is None:
            return []
        camera = self.place.world_pose.inverse
        found = [
            (camera.after(_pose(node)), node, corners) for node, corners in self.eye.patches(_owner).items()
        ]
        found = [item for item in found if math.hypot(*item[0].position) <= self.reach_m]
        found.sort(key=lambda item: math.hypot(*item[0].position))
        return [_object(*item) for item in found[: self.most if self.most >= 0 else None]]

    @property
    def picture(self) -> bytes | memoryview:
        """The current segmentation image: blue, green, red and alpha of each pixel."""
        return b"" if self.eye is None else self.eye.painted(_paint)

    def silent(self) -> bool:
        """Return whether the camera has no segmentation image."""
        return self.eye is None or not self.segments

    def segment(self, *, on: bool) -> bool:
        """Turn the publication of the segmentation image on or off; return whether that succeeded."""
        self.segmenting = on and not self.silent()
        return self.segmenting is on


@dataclass(frozen=True, slots=True, eq=False)
class _Segments:
    """The segmentation image, as a list with one item; the list is empty while the image is not enabled."""

    recognition: Recognition

    @property
    def value(self) -> list[bytes | memoryview]:
        return [self.recognition.picture] if self.recognition.segmenting else []


def read_recognition(part: DevicePart, place: Frame, lens: Lens) -> Recognition | None:
    """Return the Recognition node of a camera; None if the camera has no such node."""
    node = part.inner("recognition")
    if node is None:
        return None
    return Recognition(
        place=place,
        lens=lens,
        reach_m=part.reading.number(node, "maxRange", 100.0),
        most=int(part.reading.number(node, "maxObjects", -1.0)),
        segments=node.flag("segmentation", False),
    )


def recognition_services(recognition: Recognition) -> tuple[Row, ...]:
    """Return the services of a camera that recognizes objects, except the services of its stream."""
    save = saver(recognition.lens, recognition.silent, lambda: recognition.picture)
    return (
        ("recognition_enable_segmentation", "get_bool", lambda _: {"value": recognition.segment(on=True)}),
        ("recognition_disable_segmentation", "get_bool", lambda _: {"value": recognition.segment(on=False)}),
        ("recognition_is_segmentation_enabled", "get_bool", lambda _: {"value": recognition.segmenting}),
        ("recognition_save_segmentation_image", "save_image", save),
    )


def recognition_stream(recognition: Recognition) -> Stream:
    """Return the topics that `recognition_enable` starts."""
    objects = DeviceTopic(
        name="recognition_objects",
        type_name="webots_ros/RecognitionObjects",
        source=recognition,
        reading="objects",
    )
    image = picture_topic(
        "recognition_segmentation_image", _Segments(recognition), recognition.lens, "bgra8", many=True
    )
    return Stream(
        prefix="recognition_",
        topics=(objects, image) if recognition.segments else (objects,),
        silent=recognition.eye is None,
        enabled=lambda period_ms: _begin(recognition, period_ms),
    )


def _begin(recognition: Recognition, period_ms: int) -> None:
    if period_ms and recognition.eye is not None:
        recognition.eye.open()


def _owner(shape: SceneNode) -> SceneNode | None:
    """Return the solid with colors that contains a shape; None if no such solid contains it."""
    return next((it for it in (shape, *shape.ancestors()) if _colors(it)), None)


def _paint(shape: SceneNode) -> bytes | None:
    """Return blue, green, red and alpha of the object that contains a shape; None without an object."""
    owner = _owner(shape)
    if owner is None:
        return None
    red, green, blue = (round(_BYTE * min(1.0, max(0.0, share))) for share in _colors(owner)[0])
    return bytes((blue, green, red, _BYTE))


def _colors(node: SceneNode) -> list[tuple[float, ...]]:
    numbers = node.numbers("recognitionColors") or ()
    return [numbers[at : at + _CHANNELS] for at in range(0, len(numbers) - _CHANNELS + 1, _CHANNELS)]


def _pose(node: SceneNode) -> Pose:
    place = next((it.place for it in (node, *node.ancestors()) if it.place is not None), None)
    return Pose() if place is None else place.world_pose


def _object(pose: Pose, node: SceneNode, corners: Corners) -> dict[str, Any]:
    """Return the message of an object; `pose` is in the frame of the camera."""
    left, top, right, bottom = corners
    colors = _colors(node)
    return {
        "position": pose.position,
        "orientation": to_quaternion(pose.rotation),
        "position_on_image": (float((left + right) // 2), float((top + bottom) // 2), 0.0),
        "size_on_image": (float(right - left), float(bottom - top), 0.0),
        "number_of_colors": len(colors),
        "colors": colors,
        "model": node.text("model") or "",
    }
