"""Sensors with one value or one vector."""

from __future__ import annotations

from typing import Any, Final

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Fields, Row
from palaestra_sim.scene.devices.device_type import DeviceTopic
from palaestra_sim.scene.devices.imu_topic import imu_topic
from palaestra_sim.webots.devices.calls import (
    DeviceCalls,
    Reading,
    facts,
    lookup_table,
    neighbors,
    served,
    vector,
)

_FLOAT: Final = "webots_ros/Float64Stamped"
_POINT: Final = "geometry_msgs/PointStamped"
_BUMPER, _FORCE = 0, 1
_INFRA_RED: Final = 1
_WGS84: Final = 1
_GPS_SERVICE: Final = 1  # NavSatStatus.SERVICE_GPS
_NOTHING: Final = (0.0, 0.0, 0.0)


def distance_sensor(calls: DeviceCalls) -> ServedDevice:
    """Return a DistanceSensor."""
    constants = {
        "radiation_type": int(calls.get_type() == _INFRA_RED),
        "field_of_view": calls.get_aperture(),
        "min_range": calls.get_min_value(),
        "max_range": calls.get_max_value(),
    }
    value = DeviceTopic(
        name="value", type_name="sensor_msgs/Range", source=Reading(calls.get_value), constants=constants
    )
    rows = (
        *facts(calls, "get_float", "get_min_value", "get_max_value", "get_aperture"),
        lookup_table(calls),
        *facts(calls, "get_int", "get_type"),
    )
    return served(calls, topics=(value,), rows=rows)


def touch_sensor(calls: DeviceCalls) -> ServedDevice:
    """Return a TouchSensor; its type decides the topic."""
    rows = (*facts(calls, "get_int", "get_type"), lookup_table(calls))
    return served(calls, topics=(_touch_topic(calls),), rows=rows)


def _touch_topic(calls: DeviceCalls) -> DeviceTopic:
    kind = calls.get_type()
    if kind == _BUMPER:
        source = Reading(lambda: calls.get_value() != 0.0)
        return DeviceTopic(name="value", type_name="webots_ros/BoolStamped", source=source)
    if kind == _FORCE:
        return DeviceTopic(name="value", type_name=_FLOAT, source=Reading(calls.get_value))
    forces = vector(calls.get_values)
    return DeviceTopic(
        name="values",
        type_name="geometry_msgs/WrenchStamped",
        source=Reading(lambda: {"force": forces.value, "torque": _NOTHING}),
        reading="wrench",
    )


def light_sensor(calls: DeviceCalls) -> ServedDevice:
    """Return a LightSensor; its value is the output of its lookup table for the irradiance."""
    value = Reading(calls.get_value)
    topic = DeviceTopic(
        name="value", type_name="sensor_msgs/Illuminance", source=value, reading="illuminance"
    )
    return _with_table(calls, topic)


def position_sensor(calls: DeviceCalls) -> ServedDevice:
    """Return a PositionSensor of a joint, in rad or m."""
    rows = (*facts(calls, "get_int", "get_type"), *neighbors(calls, "brake", "motor"))
    return served(calls, topics=(_value(calls),), rows=rows)


def altimeter(calls: DeviceCalls) -> ServedDevice:
    """Return an Altimeter, in meters."""
    return served(calls, topics=(_value(calls),))


def accelerometer(calls: DeviceCalls) -> ServedDevice:
    """Return an Accelerometer, in m/s2."""
    return _with_table(calls, imu_topic("values", vector(calls.get_values), "linear_acceleration"))


def gyro(calls: DeviceCalls) -> ServedDevice:
    """Return a Gyro, in rad/s."""
    return _with_table(calls, imu_topic("values", vector(calls.get_values), "angular_velocity"))


def inertial_unit(calls: DeviceCalls) -> ServedDevice:
    """Return an InertialUnit; its value is a quaternion x, y, z, w."""
    topic = imu_topic("quaternion", vector(calls.get_quaternion, 4), "orientation")
    return served(calls, topics=(topic,), rows=facts(calls, "get_float", "get_noise"))


def compass(calls: DeviceCalls) -> ServedDevice:
    """Return a Compass; its value is a vector of length 1 to the north."""
    values = vector(calls.get_values)
    topic = DeviceTopic(
        name="values", type_name="sensor_msgs/MagneticField", source=values, reading="magnetic_field"
    )
    return _with_table(calls, topic)


def gps(calls: DeviceCalls) -> ServedDevice:
    """Return a GPS; the field gpsCoordinateSystem of the world decides the type of its positions."""
    position = vector(calls.get_values)
    values = DeviceTopic(name="values", type_name=_POINT, source=position)
    if calls.get_coordinate_system() == _WGS84:
        fix = Reading(lambda: _fix(position.value))
        values = DeviceTopic(name="values", type_name="sensor_msgs/NavSatFix", source=fix, whole=True)
    # Webots' controller leaves the frame_id of the speed empty.
    no_frame: Fields = {"header": {}}
    topics = (
        values,
        DeviceTopic(name="speed", type_name=_FLOAT, source=Reading(calls.get_speed), constants=no_frame),
        DeviceTopic(name="speed_vector", type_name=_POINT, source=vector(calls.get_speed_vector)),
    )
    return served(
        calls, topics=topics, rows=(*facts(calls, "get_int", "get_coordinate_system"), _degrees(calls))
    )


def _fix(position: tuple[float, float, float]) -> Fields:
    latitude, longitude, altitude = position
    return {
        "status": {"service": _GPS_SERVICE},
        "latitude": latitude,
        "longitude": longitude,
        "altitude": altitude,
    }


def _degrees(calls: DeviceCalls) -> Row:
    name = "decimal_degrees_to_degrees_minutes_seconds"

    def convert(request: Any) -> Fields:
        text = calls.library.gps_convert_to_degrees_minutes_seconds(request.decimalDegrees)
        return {"degreesMinutesSeconds": text}

    return name, f"gps_{name}", convert


def _value(calls: DeviceCalls) -> DeviceTopic:
    return DeviceTopic(name="value", type_name=_FLOAT, source=Reading(calls.get_value))


def _with_table(calls: DeviceCalls, topic: DeviceTopic) -> ServedDevice:
    return served(calls, topics=(topic,), rows=(lookup_table(calls),))
