"""A stub simulator, started the way a notebook does it."""

import pytest

from palaestra_trainer.launching.process import ProcessLauncher
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.webots import Mode, Webots


class Setup:
    """A running simulator and its facades; a short timeout, so that a hang is detected soon."""

    def __init__(self, *options, world="arena", supervisor="robotino", robot=None):
        self.launcher = ProcessLauncher(world, options=options)
        self.webots = Webots(supervisor, world, launcher=self.launcher, start_deadline_s=20.0)
        self.webots.start()
        self.webots.supervisor.set_mode(Mode.FAST)
        self.robot = Robotino(self.webots, robot)
        self.scene = SimulatedScene(self.webots, self.robot)
        self.robot.connect()

    @property
    def pid(self):
        """The simulator's process."""
        return self.launcher.state().pid

    def close(self):
        """End the simulator and its sidecar."""
        self.robot.close()
        self.webots.stop()
        self.webots.close()
        self.launcher.close()


@pytest.fixture
def start(master):
    """Starts simulators with options; ended when the test is."""
    del master
    started = []

    def make(*options, **where):
        started.append(Setup(*options, **where))
        return started[-1]

    yield make
    for each in started:
        each.close()


@pytest.fixture
def arena(start):
    """The shipped arena, running."""
    return start()
