"""A Robotino that needs no simulator, and the checks that every Robotino has to pass.

Shipped, not hidden among the tests: whoever writes an environment or a robot needs both.
"""

from palaestra_trainer.testing.conformance import NotConforming, check_robot, check_scene
from palaestra_trainer.testing.fake import FakeRobotino, FakeScene, fake_arena

__all__ = [
    "FakeRobotino",
    "FakeScene",
    "NotConforming",
    "check_robot",
    "check_scene",
    "fake_arena",
]
