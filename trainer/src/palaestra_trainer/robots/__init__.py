"""The interfaces through which an environment uses a robot: sensors, motion, and control periods."""

from palaestra_trainer.robots.base import RobotAbc, RobotinoAbc, Scene, SceneWrapper
from palaestra_trainer.robots.capabilities import (
    Bumper,
    Cameras,
    Distances,
    Forklift,
    Gripper,
    Joints,
    Localization,
    Omnidrive,
    Scanner,
    Steering,
    require,
)
from palaestra_trainer.robots.geometry import Movement, Pose
from palaestra_trainer.robots.layout import FloorLayout, Obstacle

__all__ = [
    "Bumper",
    "Cameras",
    "Distances",
    "FloorLayout",
    "Forklift",
    "Gripper",
    "Joints",
    "Localization",
    "Movement",
    "Obstacle",
    "Omnidrive",
    "Pose",
    "RobotAbc",
    "RobotinoAbc",
    "Scanner",
    "Scene",
    "SceneWrapper",
    "Steering",
    "require",
]
