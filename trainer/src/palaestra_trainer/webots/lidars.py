"""Lidars: their distances, scans and point clouds as arrays.

An array of a `Lidar` or of `LidarPoints` is valid until the next step, which writes the next array into the
same memory; see `image_decoding`.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.errors import ConfigurationError, NoReading, WorldMisfit, WrongData
from palaestra_trainer.webots.device import Fact
from palaestra_trainer.webots.devices import NodeSensor
from palaestra_trainer.webots.image_decoding import PointsReading, RangesReading
from palaestra_trainer.webots.lenses import LIDAR_FREQUENCY, LIDAR_INFO


class _LidarSensor(NodeSensor):
    """The base of sensors whose readings a lidar publishes.

    Every method may raise SimulatorDead, SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("Lidar",)
    info = LIDAR_INFO
    frequency = LIDAR_FREQUENCY

    def _require_layer(self, number: int) -> None:
        """Check a request for a layer, because Webots ends if it cannot fulfill the request.

        Raises:
            NoReading: the lidar has not measured yet.
            ConfigurationError: the lidar has no such layer.
        """
        layers = self.info.layers
        if not 0 <= number < layers:
            raise ConfigurationError(f"{self.device} has no layer {number}; use 0 to {layers - 1}")
        if self.value is None:
            raise NoReading(f"{self.device} has sent no reading yet; step the simulation first")

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
            NoReading: before the first step.
            ConfigurationError: the lidar has no such layer.
            WrongData: also if a distance is negative or NaN.
        """
        self._require_layer(number)
        image = self.call("get_layer_range_image", "lidar_get_layer_range_image", layer=number).image
        ranges = np.frombuffer(bytes(image.data), "<f4")
        if not (ranges >= 0.0).all():  # this form of the comparison refuses NaN too
            raise WrongData(self.robot, f"a distance that is negative or NaN from {self.device}")
        return ranges


class LaserScan(_LidarSensor):
    """The scan of a lidar with one layer; `value` is a read-only array of meters: shape (rays,), float32.

    This sensor reads a sensor_msgs/LaserScan, as ROS's tools do. Its rays are ordered as those of `Lidar`. It
    also enables the lidar.
    """

    __slots__ = ()

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "sensor_msgs/LaserScan", _ranges, "laser_scan")

    def enable(self, period_ms: int) -> None:
        """Make the lidar publish every `period_ms` of simulated time, and subscribe to its scan.

        Raises:
            WorldMisfit: the lidar has several layers, for which Webots publishes no scan.
            WrongData, SimulatorDead, SimulatorHung: as `Sensor.enable`.
        """
        layers = self.info.layers
        if layers != 1:
            fact = f"{self.device} has {layers} layers, and only a lidar with one layer has a scan; use Lidar"
            raise WorldMisfit(self.robot, fact)
        super().enable(period_ms)


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

    def disable(self) -> None:
        """Disable the point cloud, but not the lidar, and unsubscribe."""
        self.call("enable_point_cloud", "set_bool", value=False)
        self.close()

    def layer(self, number: int) -> NDArray[np.float32]:
        """Request the points of one layer: shape (rays, 3), float32; see `value`.

        Raises:
            NoReading: before the first step.
            ConfigurationError: the lidar has no such layer.
        """
        self._require_layer(number)
        cloud = self.call("get_layer_point_cloud", "lidar_get_layer_point_cloud", layer=number).pointCloud
        return np.array([(point.x, point.y, point.z) for point in cloud.points], np.float32).reshape(-1, 3)
