"""The numbers of the types of devices in Webots. Source: webots/nodes.h, R2023b."""

from __future__ import annotations

from typing import Final

_FIRST: Final = 35
_IN_ORDER: Final = """
Accelerometer Altimeter Brake Camera Compass Connector Display DistanceSensor Emitter GPS Gyro InertialUnit
LED Lidar LightSensor LinearMotor Pen PositionSensor Propeller Radar RangeFinder Receiver RotationalMotor
Skin Speaker TouchSensor VacuumGripper
"""
NODE_TYPES: Final = dict(enumerate(_IN_ORDER.split(), start=_FIRST))
