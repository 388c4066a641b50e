"""A Robotino and a task that need no simulator, and the checks that every Robotino must pass.

They are shipped, not kept among the tests, because authors of environments, robots and algorithms need them.
"""

from palaestra_trainer.testing.conformance import NotConforming, check_robot, check_scene
from palaestra_trainer.testing.fake import FakeRobotino, FakeScene, fake_arena, fake_seeing
from palaestra_trainer.testing.fake_task import FakeTask

__all__ = [
    "FakeRobotino",
    "FakeScene",
    "FakeTask",
    "NotConforming",
    "check_robot",
    "check_scene",
    "fake_arena",
    "fake_seeing",
]
