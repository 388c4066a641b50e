"""A Robotino that needs no simulator, and the checks that every Robotino must pass.

They are shipped, not kept among the tests, because authors of environments and robots need both.
"""

from palaestra_trainer.testing.conformance import NotConforming, check_robot, check_scene
from palaestra_trainer.testing.fake import FakeRobotino, FakeScene, fake_arena, fake_seeing

__all__ = [
    "FakeRobotino",
    "FakeScene",
    "NotConforming",
    "check_robot",
    "check_scene",
    "fake_arena",
    "fake_seeing",
]
