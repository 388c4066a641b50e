"""Webots as Python objects, by the services and topics of its `ros` controller; layer 2 of the trainer.

Only this package handles the peculiarities of that controller. The controller can lose a wake-up. A step
blocks forever while the simulation is paused. A reset does not restore the whole state.
"""

from palaestra_trainer.ros import ensure_node
from palaestra_trainer.webots.attached import Attached
from palaestra_trainer.webots.cameras import (
    Camera,
    CameraMatrix,
    RangeFinder,
    RecognizedObject,
    RecognizedObjects,
    SegmentedImage,
)
from palaestra_trainer.webots.detectors import Radar, RadarTarget, RadioPacket, Receiver
from palaestra_trainer.webots.device import Device, Fact
from palaestra_trainer.webots.device_check import require_node
from palaestra_trainer.webots.devices import (
    DistanceSensor,
    Motor,
    PositionSensor,
    Sensor,
    set_velocities,
)
from palaestra_trainer.webots.display import Display
from palaestra_trainer.webots.facade import Webots
from palaestra_trainer.webots.inputs import Joystick, JoystickState, Keyboard
from palaestra_trainer.webots.joint_motor import (
    Command,
    CommandedDevice,
    EffortFeedback,
    JointMotor,
    set_commands,
)
from palaestra_trainer.webots.launching.docker_launcher import Docker
from palaestra_trainer.webots.launching.kubernetes_launcher import Kubernetes
from palaestra_trainer.webots.launching.launcher import Launcher, Place
from palaestra_trainer.webots.launching.local_simulator import ThisMachine
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest
from palaestra_trainer.webots.lenses import (
    CameraInfo,
    FocusInfo,
    LidarFrequency,
    LidarInfo,
    RangeFinderInfo,
    ZoomInfo,
)
from palaestra_trainer.webots.lidars import LaserScan, Lidar, LidarPoints
from palaestra_trainer.webots.motion_sensors import (
    GPS,
    Accelerometer,
    Altimeter,
    BatterySensor,
    Compass,
    GPSSpeed,
    GPSVelocity,
    Gyro,
    InertialUnit,
    LightSensor,
)
from palaestra_trainer.webots.motor_device import MotorLimits
from palaestra_trainer.webots.mujoco import MujocoActuator, MujocoSensor
from palaestra_trainer.webots.observer import Mode, NodeName, Observer
from palaestra_trainer.webots.obstacles import FLOOR, Thing
from palaestra_trainer.webots.outputs import (
    LED,
    Brake,
    Connector,
    ConnectorPresence,
    Emitter,
    OutputDevice,
    Pen,
    Speaker,
    VacuumGripper,
    VacuumPresence,
)
from palaestra_trainer.webots.robot_controller import InputEvent, RobotController, RobotMode
from palaestra_trainer.webots.simulation import Actuator, Stepper
from palaestra_trainer.webots.skin import Skin
from palaestra_trainer.webots.supervisor import Supervisor
from palaestra_trainer.webots.touch_sensors import Force3DSensor, ForceSensor, TouchSensor
from palaestra_trainer.webots.view_settings import MovieSettings, ViewLabel
from palaestra_trainer.webots.world_node import FieldName, WorldNode

__all__ = [
    "FLOOR",
    "GPS",
    "LED",
    "Accelerometer",
    "Actuator",
    "Altimeter",
    "Attached",
    "BatterySensor",
    "Brake",
    "Camera",
    "CameraInfo",
    "CameraMatrix",
    "Command",
    "CommandedDevice",
    "Compass",
    "Connector",
    "ConnectorPresence",
    "Device",
    "Display",
    "DistanceSensor",
    "Docker",
    "EffortFeedback",
    "Emitter",
    "Fact",
    "FieldName",
    "FocusInfo",
    "Force3DSensor",
    "ForceSensor",
    "GPSSpeed",
    "GPSVelocity",
    "Gyro",
    "InertialUnit",
    "InputEvent",
    "JointMotor",
    "Joystick",
    "JoystickState",
    "Keyboard",
    "Kubernetes",
    "LaserScan",
    "Launcher",
    "Lidar",
    "LidarFrequency",
    "LidarInfo",
    "LidarPoints",
    "LightSensor",
    "Mode",
    "Motor",
    "MotorLimits",
    "MovieSettings",
    "MujocoActuator",
    "MujocoSensor",
    "NodeName",
    "Observer",
    "OutputDevice",
    "Pen",
    "Place",
    "PositionSensor",
    "Radar",
    "RadarTarget",
    "RadioPacket",
    "RangeFinder",
    "RangeFinderInfo",
    "Receiver",
    "RecognizedObject",
    "RecognizedObjects",
    "RobotController",
    "RobotMode",
    "SegmentedImage",
    "Sensor",
    "SimulatorRequest",
    "Skin",
    "Speaker",
    "Stepper",
    "Supervisor",
    "Thing",
    "ThisMachine",
    "TouchSensor",
    "VacuumGripper",
    "VacuumPresence",
    "ViewLabel",
    "Webots",
    "WorldNode",
    "ZoomInfo",
    "ensure_node",
    "require_node",
    "set_commands",
    "set_velocities",
]
