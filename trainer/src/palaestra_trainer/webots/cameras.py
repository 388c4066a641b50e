"""Cameras and depth cameras: their images as arrays, and the objects in them.

An array is valid until the next step, which writes the next array into the same memory; see `image_decoding`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Final, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.errors import ConfigurationError, NoReading, SimulatorFault, WorldMisfit, WrongData
from palaestra_trainer.webots.device import flag_fact, number_fact
from palaestra_trainer.webots.devices import NodeSensor
from palaestra_trainer.webots.image_decoding import ImageReading, RangesReading
from palaestra_trainer.webots.lenses import (
    CAMERA_INFO,
    FOCUS_INFO,
    RANGE_FINDER_INFO,
    ZOOM_INFO,
)

_BEST_QUALITY: Final = 100


class _Rendered(NodeSensor):
    """A sensor whose readings the simulator must render."""

    __slots__ = ()
    # The first sensor makes the simulator load OpenGL, which takes seconds on a busy machine.
    enable_deadline_s: ClassVar[float] = 30.0

    def _refused(self, period_ms: int) -> WrongData:
        return WorldMisfit(
            self.robot,
            f"{self.device} refuses a period of {period_ms} ms; use a multiple of the step, and a simulator"
            " that renders images, such as driver mujoco",
        )

    def _save(self, service: str, path: str | Path, quality: int) -> None:
        if not 1 <= quality <= _BEST_QUALITY:
            raise ConfigurationError(f"{self.device}: quality {quality} is refused; use 1 to {_BEST_QUALITY}")
        if not self.sampling_period_ms:
            raise NoReading(
                f"{self.device} is not enabled, so it has no image; add it to the simulation first"
            )
        self._command(service, "save_image", filename=str(path), quality=quality)

    def _array(self) -> NDArray[Any]:
        array: NDArray[Any] | None = self.value
        if array is None:
            raise NoReading(f"{self.device} has sent no reading yet; step the simulation first")
        return array


class Camera(_Rendered):
    """A camera; `value` is its read-only image: shape (height, width, 4), uint8, BGRA.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("Camera",)
    info = CAMERA_INFO
    focus = FOCUS_INFO
    zoom = ZOOM_INFO
    exposure = number_fact("get_exposure", "The exposure, in J/m2.")

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/Image", ImageReading(device), "image")

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """A view of `value` without alpha: shape (height, width, 3), RGB.

        Raises:
            NoReading: before the first step.
        """
        return self._array()[..., 2::-1]

    def set_field_of_view(self, field_of_view_rad: float) -> None:
        """Set the horizontal field of view, in rad, within the limits of `zoom`.

        Raises:
            WrongData: also if the simulator ignores the value, as without a Zoom node in the world.
        """
        self._command("set_fov", "set_float", value=field_of_view_rad)
        self._require_kept("field of view", field_of_view_rad, self.info.field_of_view_rad)

    def set_focal_distance(self, distance_m: float) -> None:
        """Set the distance at which objects are sharp, in meters, within the limits of `focus`.

        The stub and MuJoCo keep the distance; their images are sharp everywhere.

        Raises:
            WrongData: also if the simulator ignores the value, as without a Focus node in the world.
        """
        self._command("set_focal_distance", "set_float", value=distance_m)
        self._require_kept("focal distance", distance_m, self.focus.distance_m)

    def set_exposure(self, exposure: float) -> None:
        """Set the exposure, in J/m2; the stub and MuJoCo keep it, but their images do not depend on it.

        Raises:
            ConfigurationError: the exposure is negative; Webots would ignore such a value.
        """
        if not exposure >= 0.0:
            raise ConfigurationError(f"{self.device}: the exposure {exposure:g} is refused; use 0 or more")
        self._command("set_exposure", "set_float", value=exposure)

    def save_image(self, path: str | Path, quality: int = 90) -> None:
        """Save the last image as a PNG or JPEG file on the simulator's machine.

        Args:
            path: the file; an absolute path.
            quality: 1 to 100, for JPEG.

        Raises:
            NoReading: the camera is not enabled.
            ConfigurationError: the quality is out of range.
            WrongData: also if the simulator cannot write the file.
        """
        self._save("save_image", path, quality)


class RecognizedObject(NamedTuple):
    """An object that a camera recognizes.

    Attributes:
        position: x, y, z in meters in the axes of the camera.
        orientation: rotation in the axes of the camera as a quaternion: x, y, z, w.
        position_on_image: x and y of the object's middle in the image, in pixels from the upper left corner.
        size_on_image: width and height in the image, in pixels.
        colors: the object's field `recognitionColors`: red, green, blue of each color, 0 to 1.
        model: the object's field `model`.
    """

    position: tuple[float, float, float]
    orientation: tuple[float, float, float, float]
    position_on_image: tuple[float, float]
    size_on_image: tuple[float, float]
    colors: tuple[tuple[float, float, float], ...]
    model: str


class _Recognition(_Rendered):
    """The base of sensors whose readings a camera with a Recognition node publishes."""

    __slots__ = ()
    nodes = ("Camera",)
    recognizes = flag_fact("has_recognition", "Whether the camera has a Recognition node.")

    def enable(self, period_ms: int) -> None:
        """Enable the camera and its recognition.

        Raises:
            WorldMisfit: the camera has no Recognition node.
            WrongData, SimulatorDead, SimulatorHung: as `Sensor.enable`.
        """
        if not self.recognizes:
            raise self._without_recognition()
        if not self._enable(value=period_ms).success:
            raise self._refused(period_ms)
        self._recognize(period_ms)
        self._values.connect()  # only now, because Webots advertises the topic after `recognition_enable`
        self.late = False

    def explained(self, fault: SimulatorFault) -> SimulatorFault:
        """Return the reason of a fault: the world may have no Recognition node, or no camera."""
        reason = super().explained(fault)
        if reason is not fault or isinstance(fault, WorldMisfit) or not self._lacks_recognition():
            return reason
        return self._without_recognition()

    def _lacks_recognition(self) -> bool:
        """Return whether the simulator responds that the camera has no Recognition node.

        This method does not use the fact `recognizes`, which would call `explained` again if the simulator is
        dead.
        """
        try:
            answer = self._services.call_once(f"{self._path}/has_recognition", "get_bool", ask=True)
        except SimulatorFault:
            return False
        return not answer.value

    def _without_recognition(self) -> WorldMisfit:
        return WorldMisfit(self.robot, f"{self.device} has no Recognition node; add one in the world")

    def _recognize(self, period_ms: int) -> None:
        refused = f"{self.device} refuses recognition"
        self._services.confirm(f"{self._path}/recognition_enable", "set_int", refused, value=period_ms)


class RecognizedObjects(_Recognition):
    """The objects that a camera with a Recognition node recognizes; `value` is a tuple of `RecognizedObject`.

    This sensor also enables the camera. A robot may have a `Camera` of the same device in addition.
    """

    __slots__ = ()

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/RecognitionObjects", _objects, "recognition_objects")
        self._period = "recognition_get_sampling_period"

    def disable(self) -> None:
        """Disable the recognition, but not the camera, and unsubscribe."""
        self._recognize(0)
        self.close()


class SegmentedImage(_Recognition):
    """The image of a camera in which each recognized object has one color, and everything else is black.

    `value` is read-only: shape (height, width, 4), uint8, BGRA. The color of an object is the first of its
    `recognitionColors`. The Recognition node needs `segmentation TRUE`. This sensor also enables the camera.
    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    segments = flag_fact("recognition_has_segmentation", "Whether the camera can send this image.")
    segmenting = flag_fact("recognition_is_segmentation_enabled", "Whether the camera sends this image.")

    def __init__(self, robot: str, device: str) -> None:
        reading = ImageReading(device)
        super().__init__(robot, device, "sensor_msgs/Image", reading, "recognition_segmentation_image")
        self._period = "recognition_get_sampling_period"

    def disable(self) -> None:
        """Disable the segmentation, but neither recognition nor camera, and unsubscribe."""
        self.call("recognition_disable_segmentation", "get_bool", ask=True)
        self.close()

    def save_image(self, path: str | Path, quality: int = 90) -> None:
        """Save the last image as a file; see `Camera.save_image`."""
        self._save("recognition_save_segmentation_image", path, quality)

    def _recognize(self, period_ms: int) -> None:
        if not self.segments:
            fact = "cannot segment its image; set `segmentation TRUE` in its Recognition node"
            raise WorldMisfit(self.robot, f"{self.device} {fact}")
        super()._recognize(period_ms)
        if not self.call("recognition_enable_segmentation", "get_bool", ask=True).value:
            raise WrongData(self.robot, f"{self.device} refuses to segment its image")


def _objects(message: bytes | memoryview) -> tuple[RecognizedObject, ...]:
    decoded = message_type("webots_ros/RecognitionObjects").codec.decode(message)
    return tuple(
        RecognizedObject(
            position=_xyz(it.position),
            orientation=(it.orientation.x, it.orientation.y, it.orientation.z, it.orientation.w),
            position_on_image=(it.position_on_image.x, it.position_on_image.y),
            size_on_image=(it.size_on_image.x, it.size_on_image.y),
            colors=tuple(_xyz(color) for color in it.colors),
            model=it.model,
        )
        for it in decoded.objects
    )


def _xyz(vector: Any) -> tuple[float, float, float]:
    return vector.x, vector.y, vector.z


class CameraMatrix(_Rendered):
    """The projection of a camera or depth camera; `value` is its read-only matrix: shape (3, 3), float64.

    The matrix has the focal lengths and the image center in pixels, as ROS's tools use them. This sensor also
    enables the camera.
    """

    __slots__ = ()
    nodes = ("Camera", "RangeFinder")

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/CameraInfo", _matrix, "camera_info")


def _matrix(message: bytes | memoryview) -> NDArray[np.float64]:
    """Return the matrix of a sensor_msgs/CameraInfo.

    Raises:
        ValueError: a number is not finite.
    """
    matrix = np.array(message_type("sensor_msgs/CameraInfo").codec.decode(message).K, np.float64)
    if not np.isfinite(matrix).all():
        raise ValueError(f"{matrix} in a camera's matrix")
    matrix.flags.writeable = False
    return matrix.reshape(3, 3)


class RangeFinder(_Rendered):
    """A depth camera; `value` is a read-only array of meters: shape (height, width), float32.

    An infinite value means that no object is in range.
    """

    __slots__ = ()
    nodes = ("RangeFinder",)
    info = RANGE_FINDER_INFO

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/Image", RangesReading(device), "range_image")

    def save_image(self, path: str | Path, quality: int = 90) -> None:
        """Save the last image as a file; see `Camera.save_image`.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        self._save("save_image", path, quality)

    @property
    def depths(self) -> NDArray[np.float32]:
        """The same as `value`.

        Raises:
            NoReading: before the first step.
        """
        return self._array()
