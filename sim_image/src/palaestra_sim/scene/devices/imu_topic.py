"""The topic of a gyro, accelerometer or inertial unit, which fills one part of a sensor_msgs/Imu."""

from __future__ import annotations

from typing import Final

from palaestra_sim.scene.devices.device_type import DeviceTopic, ValueSource

_PARTS: Final = ("orientation", "angular_velocity", "linear_acceleration")
_NOT_MEASURED: Final = (-1.0, *(0.0,) * 8)  # a covariance that begins with -1 means that the part has no data


def imu_topic(name: str, source: ValueSource, part: str) -> DeviceTopic:
    """Return a topic whose messages have the value of `source` in `part`, and no data in other parts."""
    return DeviceTopic(
        name=name,
        type_name="sensor_msgs/Imu",
        source=source,
        constants={f"{other}_covariance": _NOT_MEASURED for other in _PARTS if other != part},
        reading=part,
    )
