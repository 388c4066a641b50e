"""The base types of nodes in Webots, with the numbers of webots/nodes.h, R2023b."""

from __future__ import annotations

from typing import Final

# Source: include/controller/c/webots/nodes.h, WbNodeType, counted from WB_NODE_NO_NODE = 0.
_NUMBERED: Final = """
- Appearance Background Billboard Box CadShape Capsule Color Cone Coordinate Cylinder
DirectionalLight ElevationGrid Fog Group ImageTexture IndexedFaceSet IndexedLineSet Material Mesh
Muscle Normal PBRAppearance Plane PointLight PointSet Pose Shape Sphere SpotLight
TextureCoordinate TextureTransform Transform Viewpoint
Robot
Accelerometer Altimeter Brake Camera Compass Connector Display DistanceSensor Emitter GPS Gyro
InertialUnit LED Lidar LightSensor LinearMotor Pen PositionSensor Propeller Radar RangeFinder
Receiver RotationalMotor Skin Speaker TouchSensor VacuumGripper
BallJoint BallJointParameters Charger ContactProperties Damping Fluid Focus HingeJoint
HingeJointParameters Hinge2Joint ImmersionProperties JointParameters Lens LensFlare Physics
Recognition SliderJoint Slot Solid SolidReference Track TrackWheel WorldInfo Zoom
Microphone Radio
"""
_NUMBERS: Final = {name: number for number, name in enumerate(_NUMBERED.split())}
BASE_TYPES: Final = frozenset(_NUMBERS) - {"-"}


def type_number(type_name: str) -> int:
    """Return the number that `supervisor/node/get_type` returns; 0 for an unknown type."""
    return _NUMBERS.get(type_name, 0)


def is_base_type(type_name: str) -> bool:
    """Return whether Webots has a base type of this name, so that it is not a PROTO."""
    return type_name in BASE_TYPES
