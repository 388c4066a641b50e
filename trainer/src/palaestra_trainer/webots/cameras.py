"""The sensors of a robot whose readings are arrays: cameras, depth cameras and lidars.

An array is valid until the next step, which writes the next array into the same memory; see `image_decoding`.
"""

from __future__ import annotations

from typing import Any, ClassVar, NamedTuple

import numpy as np
from numpy.typing import NDArray

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.errors import NoReading, WorldMisfit, WrongData
from palaestra_trainer.ros import RosService
from palaestra_trainer.webots.devices import Sensor, topic_name
from palaestra_trainer.webots.image_decoding import ImageReading, PointsReading, RangesReading
from palaestra_trainer.webots.services import Services


class _Rendered(Sensor):
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

    def _array(self) -> NDArray[Any]:
        array: NDArray[Any] | None = self.value
        if array is None:
            raise NoReading(f"{self.device} has sent no reading yet; step the simulation first")
        return array


class Camera(_Rendered):
    """A camera; `value` is its read-only image: shape (height, width, 4), uint8, BGRA."""

    __slots__ = ()

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/Image", ImageReading(device), "image")

    @property
    def rgb(self) -> NDArray[np.uint8]:
        """A view of `value` without alpha: shape (height, width, 3), RGB.

        Raises:
            NoReading: before the first step.
        """
        return self._array()[..., 2::-1]


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


class RecognizedObjects(_Rendered):
    """The objects that a camera with a Recognition node recognizes; `value` is a tuple of `RecognizedObject`.

    This sensor also enables the camera. A robot may have a `Camera` of the same device in addition.
    """

    __slots__ = ("_services",)

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/RecognitionObjects", _objects, "recognition_objects")
        self._services = Services(robot)

    def enable(self, period_ms: int) -> None:
        """Enable the camera and its recognition.

        Raises:
            WorldMisfit: the camera has no Recognition node.
            WrongData, SimulatorDead, SimulatorHung: as `Sensor.enable`.
        """
        path = topic_name(self.device)
        if not self._services.ask(f"{path}/has_recognition", "get_bool"):
            raise WorldMisfit(self.robot, f"{self.device} has no Recognition node; add one in the world")
        if not self._enable(value=period_ms).success:
            raise self._refused(period_ms)
        self._services.confirm(
            f"{path}/recognition_enable", "set_int", f"{self.device} refuses recognition", value=period_ms
        )
        self._values.connect()  # only now, because Webots advertises the topic after `recognition_enable`
        self.late = False

    def close(self) -> None:
        """Close the connections."""
        super().close()
        self._services.close()


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

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/Image", RangesReading(device), "range_image")

    @property
    def depths(self) -> NDArray[np.float32]:
        """The same as `value`.

        Raises:
            NoReading: before the first step.
        """
        return self._array()


class Lidar(Sensor):
    """A lidar; `value` is a read-only array of meters: shape (layers, rays), float32.

    An infinite value means that no object is in range. The layers are ordered from the top down. The rays of
    a layer are ordered from left to right.
    """

    __slots__ = ()

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/Image", RangesReading(device), "range_image")


class LidarPoints(Sensor):
    """The point cloud of a lidar; this sensor also enables the lidar.

    A robot may have a `Lidar` of the same device in addition. `value` is a read-only array: shape (layers *
    rays, 3), float32, with x, y and z in meters in the lidar's frame. The values of a ray without a hit are
    infinite.
    """

    __slots__ = ("_cloud",)

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/PointCloud2", PointsReading(device), "point_cloud")
        self._cloud = RosService(f"/{robot}/{topic_name(device)}/enable_point_cloud", "webots_ros/set_bool")

    def enable(self, period_ms: int) -> None:
        """Enable the lidar and its point cloud.

        Raises:
            WrongData: the period is not a multiple of the step.
            SimulatorDead, SimulatorHung: as `RosService`.
        """
        super().enable(period_ms)
        if not self._cloud(value=True).success:
            raise WrongData(
                self.robot, f"{self.device} refuses to send a point cloud; use its ranges instead"
            )

    def close(self) -> None:
        """Close the connections."""
        super().close()
        self._cloud.close()
