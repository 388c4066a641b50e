"""Cameras and range finders, whose values are pictures in shared memory.

A topic has no message while Webots has no picture, for example right after `enable`.
"""

from __future__ import annotations

from typing import Any, Final

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Fields, Handler, Row
from palaestra_sim.scene.camera_interface import Lens
from palaestra_sim.scene.devices.camera_common import PIXEL_BYTES, picture_topic, projection_topic
from palaestra_sim.scene.devices.device_type import DeviceTopic, Stream
from palaestra_sim.scene.geometry import axis_angle_to_quaternion
from palaestra_sim.webots.devices.calls import (
    DeviceCalls,
    Reading,
    commands,
    copied,
    elements,
    facts,
    served,
    switch,
)
from palaestra_sim.webots.library import RecognitionObject

_CHANNELS: Final = 3


def camera(calls: DeviceCalls) -> ServedDevice:
    """Return a Camera."""
    lens = _lens(calls, calls.get_near())
    image = Reading(lambda: copied(calls.get_image(), _bytes(lens)))
    recognizes = calls.has_recognition()
    rows = (
        ("get_info", "camera_get_info", lambda _: _info(calls)),
        ("get_focus_info", "camera_get_focus_info", lambda _: _focus_info(calls)),
        ("get_zoom_info", "camera_get_zoom_info", lambda _: _zoom_info(calls)),
        ("save_image", "save_image", _saver(calls, "save_image")),
        ("set_fov", "set_float", _fov_setter(calls, lens)),
        *commands(calls, "set_float", "set_focal_distance", "set_exposure"),
        *facts(calls, "get_float", "get_exposure"),
        *facts(calls, "get_bool", "has_recognition", "recognition_has_segmentation"),
        *(_recognition_rows(calls) if recognizes else ()),
    )
    return served(
        calls,
        topics=(picture_topic("image", image, lens, "bgra8", many=True), projection_topic(lens)),
        rows=rows,
        streams=(_recognition(calls, lens),) if recognizes else (),
        camera=calls.name,
    )


def range_finder(calls: DeviceCalls) -> ServedDevice:
    """Return a RangeFinder; its picture has a distance in meters for each pixel."""
    lens = _lens(calls, calls.get_min_range())
    image = Reading(lambda: copied(calls.get_range_image(), _bytes(lens)))
    rows = (
        ("get_info", "range_finder_get_info", lambda _: _range_info(calls)),
        ("save_image", "save_image", _saver(calls, "save_image")),
    )
    topics = picture_topic("range_image", image, lens, "32FC1", many=True), projection_topic(lens)
    return served(calls, topics=topics, rows=rows)


def _lens(calls: DeviceCalls, near_m: float) -> Lens:
    size = calls.get_width(), calls.get_height()
    return Lens(size=size, field_of_view_rad=calls.get_fov(), near_m=near_m, far_m=0.0)


def _bytes(lens: Lens) -> int:
    width, height = lens.size
    return PIXEL_BYTES * width * height


def _info(calls: DeviceCalls) -> Fields:
    return {
        "width": calls.get_width(),
        "height": calls.get_height(),
        "Fov": calls.get_fov(),
        "nearRange": calls.get_near(),
    }


def _range_info(calls: DeviceCalls) -> Fields:
    return {
        "width": calls.get_width(),
        "height": calls.get_height(),
        "Fov": calls.get_fov(),
        "minRange": calls.get_min_range(),
        "maxRange": calls.get_max_range(),
    }


def _focus_info(calls: DeviceCalls) -> Fields:
    return {
        "focalLength": calls.get_focal_length(),
        "focalDistance": calls.get_focal_distance(),
        "maxFocalDistance": calls.get_max_focal_distance(),
        "minFocalDistance": calls.get_min_focal_distance(),
    }


def _zoom_info(calls: DeviceCalls) -> Fields:
    return {"minFov": calls.get_min_fov(), "maxFov": calls.get_max_fov()}


def _fov_setter(calls: DeviceCalls, lens: Lens) -> Handler:
    def set_fov(request: Any) -> Fields:
        """Set the field of view; the projection uses the value that Webots has accepted."""
        calls.set_fov(request.value)
        lens.field_of_view_rad = calls.get_fov()
        return {"success": True}

    return set_fov


def _saver(calls: DeviceCalls, function: str) -> Handler:
    """Return a handler that saves a picture; the C function returns 0 for success and -1 for failure."""
    save = getattr(calls, function)
    return lambda request: {"success": 1 + save(request.filename, request.quality)}


def _recognition_rows(calls: DeviceCalls) -> tuple[Row, ...]:
    def segment(*, on: bool) -> Fields:
        (calls.recognition_enable_segmentation if on else calls.recognition_disable_segmentation)()
        return {"value": bool(calls.recognition_is_segmentation_enabled()) is on}

    save = "recognition_save_segmentation_image"
    return (
        ("recognition_enable_segmentation", "get_bool", lambda _: segment(on=True)),
        ("recognition_disable_segmentation", "get_bool", lambda _: segment(on=False)),
        *facts(calls, "get_bool", "recognition_is_segmentation_enabled"),
        (save, "save_image", _saver(calls, save)),
    )


def _recognition(calls: DeviceCalls, lens: Lens) -> Stream:
    """Return the topics that `recognition_enable` starts."""
    objects = DeviceTopic(
        name="recognition_objects",
        type_name="webots_ros/RecognitionObjects",
        source=Reading(lambda: _objects(calls)),
        reading="objects",
    )
    image = picture_topic(
        "recognition_segmentation_image", Reading(lambda: _segments(calls, lens)), lens, "bgra8", many=True
    )
    return Stream(
        prefix="recognition_",
        topics=(objects, image) if calls.recognition_has_segmentation() else (objects,),
        silent=False,
        enabled=switch(calls, begin="recognition_"),
    )


def _segments(calls: DeviceCalls, lens: Lens) -> list[bytes]:
    if not calls.recognition_is_segmentation_enabled():
        return []
    return copied(calls.recognition_get_segmentation_image(), _bytes(lens))


def _objects(calls: DeviceCalls) -> list[Fields]:
    objects = elements(calls.recognition_get_objects(), calls.recognition_get_number_of_objects())
    return [_object(it) for it in objects]


def _object(found: RecognitionObject) -> Fields:
    colors = found.colors[: _CHANNELS * found.number_of_colors]
    return {
        "position": tuple(found.position),
        "orientation": axis_angle_to_quaternion(tuple(found.orientation)),
        "position_on_image": (*map(float, found.position_on_image), 0.0),
        "size_on_image": (*map(float, found.size_on_image), 0.0),
        "number_of_colors": found.number_of_colors,
        "colors": [tuple(colors[at : at + _CHANNELS]) for at in range(0, len(colors), _CHANNELS)],
        "model": (found.model or b"").decode(errors="replace"),
    }
