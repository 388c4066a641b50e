"""Camera: the settings of a camera, and its images if the simulator renders.

Without rendering, `enable` and the services that save images return failure. Distortion, focus, exposure,
motion blur and noise have no effect.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Handler, Row
from palaestra_sim.scene.camera_interface import CameraInterface, Lens
from palaestra_sim.scene.devices.camera_common import picture_topic, projection_topic, read_lens, saver
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceTopic, DeviceType, Stream
from palaestra_sim.scene.devices.recognition import (
    Recognition,
    read_recognition,
    recognition_services,
    recognition_stream,
)
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.old_axes import looking


@dataclass(slots=True, kw_only=True, eq=False)
class Camera:
    """A camera.

    Attributes:
        place: the frame of the camera.
        lens: the lens, whose field of view a client may change.
        spherical: whether the world requests a spherical image, which is not rendered.
        exposure: the exposure in the world, or the exposure that a client set.
        focus: focal length, focal distance, and the highest and lowest focal distance, in meters; None
            without a Focus node.
        zoom: minimum and maximum field of view in rad; None without a Zoom node.
        recognition: the camera's Recognition node; None without such a node.
        eye: the camera interface; None if the simulator does not render.
    """

    name: str
    model: str
    place: Frame
    lens: Lens
    spherical: bool
    exposure: float
    focus: tuple[float, float, float, float] | None = None
    zoom: tuple[float, float] | None = None
    recognition: Recognition | None = None
    eye: CameraInterface | None = None

    @property
    def value(self) -> bytes | memoryview:
        """The current image: blue, green, red and alpha of each pixel."""
        return b"" if self.eye is None else self.eye.colors()

    def attach(self, robot: Carrier) -> None:
        """Connect the camera to the robot that carries it."""
        self.eye = None if self.spherical else robot.eye(self.place, self.lens)
        if self.recognition is not None:
            self.recognition.eye = self.eye

    def enabled(self, period_ms: int) -> None:
        """Prepare to render.

        Raises:
            UnsimulatedError: this machine cannot render.
        """
        if period_ms and self.eye is not None:
            self.eye.open()


def _read(part: DevicePart) -> Camera:
    lens = read_lens(part, part.number("near", 0.01), part.number("far", 0.0))
    place = looking(part.node, part.place)
    return Camera(
        name=part.name,
        model=part.text("model"),
        place=place,
        lens=lens,
        spherical=part.node.flag("spherical", False),
        exposure=part.number("exposure", 1.0),
        focus=_focus(part),
        zoom=_zoom(part),
        recognition=read_recognition(part, place, lens),
    )


def _focus(part: DevicePart) -> tuple[float, float, float, float] | None:
    focus = part.inner("focus")
    if focus is None:
        return None
    length, distance, highest, lowest = (
        part.reading.number(focus, name, 0.0)
        for name in ("focalLength", "focalDistance", "maxFocalDistance", "minFocalDistance")
    )
    return length, distance, highest, lowest


def _zoom(part: DevicePart) -> tuple[float, float] | None:
    zoom = part.inner("zoom")
    if zoom is None:
        return None
    number = part.reading.number
    return number(zoom, "minFieldOfView", 0.5), number(zoom, "maxFieldOfView", 1.5)


def _services(camera: Camera) -> tuple[Row, ...]:
    recognition = camera.recognition
    segments = recognition is not None and recognition.segments
    return (
        ("get_info", "camera_get_info", lambda _: _info(camera)),
        ("get_focus_info", "camera_get_focus_info", lambda _: _focus_info(camera)),
        ("get_zoom_info", "camera_get_zoom_info", lambda _: _zoom_info(camera)),
        ("save_image", "save_image", saver(camera.lens, lambda: camera.eye is None, lambda: camera.value)),
        ("set_fov", "set_float", _fov_setter(camera)),
        ("set_focal_distance", "set_float", _focus_setter(camera)),
        ("set_exposure", "set_float", _exposure_setter(camera)),
        ("get_exposure", "get_float", lambda _: {"value": camera.exposure}),
        ("has_recognition", "get_bool", lambda _: {"value": recognition is not None}),
        ("recognition_has_segmentation", "get_bool", lambda _: {"value": segments}),
        *(() if recognition is None else recognition_services(recognition)),
    )


def _streams(camera: Camera) -> tuple[Stream, ...]:
    return () if camera.recognition is None else (recognition_stream(camera.recognition),)


def _info(camera: Camera) -> Fields:
    lens = camera.lens
    width, height = lens.size
    return {"width": width, "height": height, "Fov": lens.field_of_view_rad, "nearRange": lens.near_m}


def _focus_info(camera: Camera) -> Fields:
    length, distance, highest, lowest = camera.focus or (0.0, 0.0, 0.0, 0.0)
    return {
        "focalLength": length,
        "focalDistance": distance,
        "maxFocalDistance": highest,
        "minFocalDistance": lowest,
    }


def _zoom_info(camera: Camera) -> Fields:
    low, high = camera.zoom or (camera.lens.field_of_view_rad, camera.lens.field_of_view_rad)
    return {"minFov": low, "maxFov": high}


def _fov_setter(camera: Camera) -> Handler:
    def set_fov(request: Any) -> Fields:
        """Set the field of view; ignore a value outside the limits of the Zoom node, as in Webots."""
        if camera.zoom is not None and camera.zoom[0] <= request.value <= camera.zoom[1]:
            camera.lens.field_of_view_rad = request.value
        return {"success": True}

    return set_fov


def _focus_setter(camera: Camera) -> Handler:
    def set_focal_distance(request: Any) -> Fields:
        """Set the focal distance; ignore a value outside the limits of the Focus node, as in Webots."""
        if camera.focus is not None:
            length, _, highest, lowest = camera.focus
            if lowest <= request.value <= highest:
                camera.focus = length, request.value, highest, lowest
        return {"success": True}

    return set_focal_distance


def _exposure_setter(camera: Camera) -> Handler:
    def set_exposure(request: Any) -> Fields:
        camera.exposure = request.value
        return {"success": True}

    return set_exposure


def _topics(camera: Camera) -> tuple[DeviceTopic, ...]:
    return picture_topic("image", camera, camera.lens, "bgra8"), projection_topic(camera.lens)


CAMERA: Final = DeviceType(
    node="Camera",
    name="camera",
    without_effect="""exposure antiAliasing ambientOcclusionRadius bloomThreshold motionBlur noise
        noiseMaskUrl lens focus lensFlare""",
    fields="""fieldOfView SFFloat 0.7854; width SFInt32 64; height SFInt32 64; spherical SFBool FALSE;
        near SFFloat 0.01; far SFFloat 0; exposure SFFloat 1; antiAliasing SFBool FALSE;
        ambientOcclusionRadius SFFloat 0; bloomThreshold SFFloat -1; motionBlur SFFloat 0;
        noise SFFloat 0; noiseMaskUrl MFString; lens SFNode; focus SFNode; zoom SFNode;
        recognition SFNode; lensFlare SFNode""",
    read=_read,
    services=_services,
    topics=_topics,
    streams=_streams,
    attach=Camera.attach,
    enabled=Camera.enabled,
    silent=lambda camera: camera.eye is None,
)
