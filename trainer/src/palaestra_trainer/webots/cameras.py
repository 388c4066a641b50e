"""The sensors of a robot whose readings are arrays: cameras, depth cameras and lidars.

An array is valid until the next step, which writes the next array into the same memory; see `image_decoding`.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.errors import NoReading, WorldMisfit, WrongData
from palaestra_trainer.webots.device import Fact, flag_fact, number_fact
from palaestra_trainer.webots.devices import NodeSensor
from palaestra_trainer.webots.image_decoding import ImageReading, PointsReading, RangesReading
from palaestra_trainer.webots.lenses import (
    CAMERA_INFO,
    FOCUS_INFO,
    LIDAR_FREQUENCY,
    LIDAR_INFO,
    RANGE_FINDER_INFO,
    ZOOM_INFO,
)


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
        """Set the exposure, in J/m2; the stub and MuJoCo keep it, but their images do not depend on it."""
        self._command("set_exposure", "set_float", value=exposure)

    def save_image(self, path: str | Path, quality: int = 90) -> None:
        """Save the last image as a PNG or JPEG file on the simulator's machine.

        Args:
            path: the file; an absolute path.
            quality: 1 to 100, for JPEG.

        Raises:
            WrongData: also if the camera is not enabled, or the simulator cannot write the file.
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
    """Something that a camera with a Recognition node publishes."""

    __slots__ = ()
    recognizes = flag_fact("has_recognition", "Whether the camera has a Recognition node.")

    def enable(self, period_ms: int) -> None:
        """Enable the camera and its recognition.

        Raises:
            WorldMisfit: the camera has no Recognition node.
            WrongData, SimulatorDead, SimulatorHung: as `Sensor.enable`.
        """
        if not self.recognizes:
            raise WorldMisfit(self.robot, f"{self.device} has no Recognition node; add one in the world")
        if not self._enable(value=period_ms).success:
            raise self._refused(period_ms)
        self._recognize(period_ms)
        self._values.connect()  # only now, because Webots advertises the topic after `recognition_enable`
        self.late = False

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
        """Disable the segmentation and the camera, and unsubscribe."""
        self.call("recognition_disable_segmentation", "get_bool", ask=True)
        super().disable()

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


class RangeFinder(_Rendered):
    """A depth camera; `value` is a read-only array of meters: shape (height, width), float32.

    An infinite value means that no object is in range.
    """

    __slots__ = ()
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


class _LidarSensor(NodeSensor):
    """Something that a lidar publishes; every method may raise SimulatorDead, SimulatorHung or WrongData."""

    __slots__ = ()
    info = LIDAR_INFO
    frequency = LIDAR_FREQUENCY

    def set_frequency(self, frequency_hz: float) -> None:
        """Set the rotations per second of the head, within the limits of `frequency`.

        Raises:
            WrongData: also if the simulator ignores the value.
        """
        self._command("set_frequency", "set_float", value=frequency_hz)
        self._require_kept("frequency", frequency_hz, self.frequency.frequency_hz)


class Lidar(_LidarSensor):
    """A lidar; `value` is a read-only array of meters: shape (layers, rays), float32.

    An infinite value means that no object is in range. The layers are ordered from the top down. The rays of
    a layer are ordered from left to right.
    """

    __slots__ = ()

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/Image", RangesReading(device), "range_image")

    def layer(self, number: int) -> NDArray[np.float32]:
        """Request the distances of one layer: shape (rays,), float32, in meters.

        Raises:
            WrongData: also if the lidar has no such layer.
        """
        image = self.call("get_layer_range_image", "lidar_get_layer_range_image", layer=number).image
        return np.frombuffer(bytes(image.data), "<f4")


class LaserScan(_LidarSensor):
    """One layer of a lidar; `value` is a read-only array of meters: shape (rays,), float32.

    This sensor reads a sensor_msgs/LaserScan, as ROS's tools do. Its rays are ordered as those of `Lidar`. It
    also enables the lidar.

    Args:
        robot: the ROS name of the robot's controller.
        device: the lidar's name in the world.
        layer: the number of the layer; 0 is the highest one.
    """

    __slots__ = ()

    def __init__(self, robot: str, device: str, layer: int = 0) -> None:
        super().__init__(robot, device, "sensor_msgs/LaserScan", _ranges, f"laser_scan/layer{layer}")


def _ranges(message: bytes | memoryview) -> NDArray[np.float32]:
    """Return the distances of a sensor_msgs/LaserScan.

    Raises:
        ValueError: a distance is negative or NaN.
    """
    ranges = np.array(message_type("sensor_msgs/LaserScan").codec.decode(message).ranges, np.float32)
    if not (ranges >= 0.0).all():  # this form of the comparison refuses NaN too
        raise ValueError("a distance that is negative or NaN")
    ranges.flags.writeable = False
    return ranges


class LidarPoints(_LidarSensor):
    """The point cloud of a lidar; this sensor also enables the lidar.

    A robot may have a `Lidar` of the same device in addition. `value` is a read-only array: shape (layers *
    rays, 3), float32, with x, y and z in meters in the lidar's frame. The values of a ray without a hit are
    infinite.
    """

    __slots__ = ()
    enabled = Fact(
        "is_point_cloud_enabled",
        "node_get_status",
        lambda response: bool(response.status),
        "Whether the lidar sends its point cloud.",
    )

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/PointCloud2", PointsReading(device), "point_cloud")

    def enable(self, period_ms: int) -> None:
        """Enable the lidar and its point cloud.

        Raises:
            WrongData: the period is not a multiple of the step.
            SimulatorDead, SimulatorHung: as `RosService`.
        """
        super().enable(period_ms)
        if not self.call("enable_point_cloud", "set_bool", value=True).success:
            raise WrongData(
                self.robot, f"{self.device} refuses to send a point cloud; use its ranges instead"
            )

    def layer(self, number: int) -> NDArray[np.float32]:
        """Request the points of one layer: shape (rays, 3), float32; see `value`.

        Raises:
            WrongData: also if the lidar has no such layer, or is not enabled.
        """
        cloud = self.call("get_layer_point_cloud", "lidar_get_layer_point_cloud", layer=number).pointCloud
        return np.array([(point.x, point.y, point.z) for point in cloud.points], np.float32).reshape(-1, 3)
