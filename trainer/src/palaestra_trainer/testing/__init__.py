"""Fake robots and a fake task that need no simulator, and the checks that every robot must pass.

The fakes and checks ship with the package, because authors of environments, robots and algorithms need them.
"""

from palaestra_trainer.testing.conformance import NotConforming, check_robot, check_scene
from palaestra_trainer.testing.fake_burger import FakeBurger, fake_court
from palaestra_trainer.testing.fake_epuck import FakeEPuck, fake_pen
from palaestra_trainer.testing.fake_robotino import (
    FakeRobotino,
    FakeSeeingRobotino,
    fake_arena,
    fake_seeing,
)
from palaestra_trainer.testing.fake_scene import FakeScene
from palaestra_trainer.testing.fake_task import FakeTask, MaskedTask

__all__ = [
    "FakeBurger",
    "FakeEPuck",
    "FakeRobotino",
    "FakeScene",
    "FakeSeeingRobotino",
    "FakeTask",
    "MaskedTask",
    "NotConforming",
    "check_robot",
    "check_scene",
    "fake_arena",
    "fake_court",
    "fake_pen",
    "fake_seeing",
]
