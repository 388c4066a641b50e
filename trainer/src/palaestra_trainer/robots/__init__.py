"""Robots as an environment sees them: what they sense, how they drive, when time passes."""

from palaestra_trainer.robots.base import Movement, Pose, RobotinoAbc, Scene

__all__ = ["Movement", "Pose", "RobotinoAbc", "Scene"]
