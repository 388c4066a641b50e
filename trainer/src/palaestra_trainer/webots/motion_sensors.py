"""Sensors that measure position, motion and the environment of a robot, as numbers."""

from __future__ import annotations

import math
from typing import ClassVar, Final

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.ros import RosSubscriber
from palaestra_trainer.webots.device import Fact, lookup_table_fact, number_fact
from palaestra_trainer.webots.devices import NodeSensor, Sensor
from palaestra_trainer.webots.message_decoding import FLOAT64, POINT, NumberReading, PickedReading

AXES: Final = "xyz"
_IMU: Final = "37d"  # sensor_msgs/Imu: orientation, turning rate and acceleration, each with a covariance
_FIELD: Final = "12d"  # sensor_msgs/MagneticField: x, y, z, and a covariance
_ILLUMINANCE: Final = "2d"  # sensor_msgs/Illuminance: the reading, and a variance
# sensor_msgs/NavSatFix: status, service, latitude, longitude, altitude, a covariance and its type
_NAV_SAT_FIX: Final = "bH12dB"
_WGS84: Final = 1  # the number of the coordinate system; 0 is the world's own. Source: webots/gps.h
_ORIENTATION, _RATE, _ACCELERATION = 0, 13, 25  # positions of the first numbers in sensor_msgs/Imu


class _AxesSensor(NodeSensor):
    """A sensor with one number for each axis.

    Args:
        robot: the ROS name of the robot's controller.
        device: the device's name in the world.
        axes: the axes to read, in their order in `value`. Leave out an axis that is switched off in the
            world, because the simulator then sends NaN for this axis.

    Raises:
        ConfigurationError: `axes` contains other letters than x, y and z.
    """

    __slots__ = ()
    lookup_table = lookup_table_fact()
    type_name: ClassVar[str]
    codes: ClassVar[str]
    first: ClassVar[int] = 0

    def __init__(self, robot: str, device: str, axes: str = AXES) -> None:
        if not axes or not set(axes) <= set(AXES):
            raise ConfigurationError(
                f'{device}: axes "{axes}" are not letters of {AXES}; write "xz", for example'
            )
        picked = tuple(self.first + AXES.index(axis) for axis in axes)
        super().__init__(robot, device, self.type_name, PickedReading(device, self.codes, picked), "values")


class Compass(_AxesSensor):
    """A compass; `value` is the direction of north in the sensor's axes: x, y, z of a unit vector."""

    __slots__ = ()
    nodes = ("Compass",)
    type_name = "sensor_msgs/MagneticField"
    codes = _FIELD


class Gyro(_AxesSensor):
    """A gyro; `value` is the turning rate about the sensor's axes in rad/s: x, y, z."""

    __slots__ = ()
    nodes = ("Gyro",)
    type_name = "sensor_msgs/Imu"
    codes = _IMU
    first = _RATE


class Accelerometer(_AxesSensor):
    """An accelerometer; `value` is the acceleration along the sensor's axes in m/s2: x, y, z.

    At rest, `value` is the reaction to gravity, so the axis that points up reads 9.81.
    """

    __slots__ = ()
    nodes = ("Accelerometer",)
    type_name = "sensor_msgs/Imu"
    codes = _IMU
    first = _ACCELERATION


class GPS(NodeSensor):
    """A GPS; `value` is its position: x, y, z in meters in the axes of the world.

    In a world with `gpsCoordinateSystem "WGS84"`, `value` is latitude and longitude in degrees, and altitude
    in meters.
    """

    __slots__ = ("_fix",)
    nodes = ("GPS",)
    geographic = Fact(
        "get_coordinate_system",
        "get_int",
        lambda response: response.value == _WGS84,
        "Whether `value` is latitude, longitude and altitude.",
    )

    def __init__(self, robot: str, device: str) -> None:
        reading = PickedReading(device, POINT, (0, 1, 2))
        super().__init__(robot, device, "geometry_msgs/PointStamped", reading, "values")
        self._fix = False

    def enable(self, period_ms: int) -> None:
        """Make the GPS publish every `period_ms` of simulated time, and subscribe to its topic.

        Raises:
            WrongData, SimulatorDead, SimulatorHung: as `Sensor.enable`.
        """
        if self.geographic and not self._fix:
            # In such a world, the topic has another type.
            reading = PickedReading(self.device, _NAV_SAT_FIX, (2, 3, 4))
            self._values = RosSubscriber(self._values.name, "sensor_msgs/NavSatFix", reading)
            self._fix = True
        super().enable(period_ms)

    def degrees_minutes_seconds(self, angle_deg: float) -> str:
        """Return an angle, such as a latitude, as text with degrees, minutes and seconds.

        The simulator rounds toward zero, and computes with the precision of float32.

        Raises:
            ConfigurationError: the angle is not finite.
            SimulatorDead, SimulatorHung, WrongData: as `RosService`.
        """
        if not math.isfinite(angle_deg):
            raise ConfigurationError(
                f"{self.device}: {angle_deg:g} is not an angle; give a finite number of degrees"
            )
        name = "decimal_degrees_to_degrees_minutes_seconds"
        return str(self.call(name, f"gps_{name}", decimalDegrees=angle_deg).degreesMinutesSeconds)


class GPSSpeed(NodeSensor):
    """The speed that a GPS measures; `value` is in m/s. This sensor also enables the GPS."""

    __slots__ = ()
    nodes = ("GPS",)

    def __init__(self, robot: str, device: str) -> None:
        reading = NumberReading(device, FLOAT64)
        super().__init__(robot, device, "webots_ros/Float64Stamped", reading, "speed")


class GPSVelocity(NodeSensor):
    """The velocity of a GPS; `value` is x, y, z in m/s in the axes of the world.

    This sensor also enables the GPS.
    """

    __slots__ = ()
    nodes = ("GPS",)

    def __init__(self, robot: str, device: str) -> None:
        reading = PickedReading(device, POINT, (0, 1, 2))
        super().__init__(robot, device, "geometry_msgs/PointStamped", reading, "speed_vector")


class InertialUnit(NodeSensor):
    """An inertial unit; `value` is the rotation of the sensor in the world as a quaternion: x, y, z, w."""

    __slots__ = ()
    nodes = ("InertialUnit",)
    noise = number_fact(
        "get_noise", "The standard deviation of the noise about each axis, as a fraction of pi."
    )

    def __init__(self, robot: str, device: str) -> None:
        picked = tuple(range(_ORIENTATION, _ORIENTATION + 4))
        super().__init__(robot, device, "sensor_msgs/Imu", PickedReading(device, _IMU, picked), "quaternion")

    @property
    def roll_pitch_yaw(self) -> tuple[float, float, float] | None:
        """The same rotation as angles in radians, about x, then y, then z of a world whose z axis points up.

        The value is None before the first step. At a pitch of 90 degrees, only the sum or the difference of
        roll and yaw is defined.
        """
        if self.value is None:
            return None
        x, y, z, w = self.value
        return (
            math.atan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y)),
            math.asin(max(-1.0, min(1.0, 2.0 * (w * y - z * x)))),
            math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z)),
        )


class Altimeter(NodeSensor):
    """An altimeter; `value` is the height of the sensor in the world, in meters."""

    __slots__ = ()
    nodes = ("Altimeter",)

    def __init__(self, robot: str, device: str) -> None:
        super().__init__(robot, device, "webots_ros/Float64Stamped", NumberReading(device, FLOAT64))


class LightSensor(NodeSensor):
    """A light sensor; `value` is the output of its lookup table, or W/m2 if the table is empty."""

    __slots__ = ()
    nodes = ("LightSensor",)
    lookup_table = lookup_table_fact()

    def __init__(self, robot: str, device: str) -> None:
        reading = PickedReading(device, _ILLUMINANCE, (0,))
        super().__init__(robot, device, "sensor_msgs/Illuminance", lambda message: reading(message)[0])


class BatterySensor(Sensor):
    """The battery of a robot; `value` is its energy in J, or -1 for a robot without a battery.

    Args:
        robot: the ROS name of the robot's controller.
    """

    __slots__ = ()
    listed = False

    def __init__(self, robot: str) -> None:
        reading = NumberReading("battery_sensor", FLOAT64)
        super().__init__(robot, "battery_sensor", "webots_ros/Float64Stamped", reading)
