"""A simulator that fails while it is paused for an update causes a fault, and no error of the caller."""

import os
import signal

import gymnasium
import numpy as np
import pytest

import palaestra_trainer.environments  # noqa: F401 - registers the environment
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.restarter import Restarter, await_one
from palaestra_trainer.simulators.simulator import Simulator
from palaestra_trainer.webots import Mode
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher
from tests.waiting import eventually

STAND = np.zeros(1, dtype=np.int64)
PATIENCE_S = 60.0


class Rested:
    """A running simulator in a vector environment."""

    def __init__(self):
        def make(robot, scene):
            return gymnasium.make("MoveToTargetEnv-v0", disable_env_checker=True, robot=robot, scene=scene)

        self.launcher = ProcessLauncher("arena")
        self.simulator = Simulator("collect-0", self.launcher, make, PATIENCE_S)
        self.restarter = Restarter(self.simulator)
        self.restarter.begin_start()
        await_one([self.restarter])
        self.env = SimulatorsVecEnv([self.restarter], 0)
        self.env.reset()

    def step(self):
        """Take a step, and return the info."""
        return self.env.step(STAND)[3][0]

    def close(self):
        """End the environment, the simulator and the sidecar."""
        self.env.close()
        self.restarter.stop()
        self.launcher.close()


@pytest.fixture
def rested(master):
    """Yield a simulator that has made a step and is now paused."""
    del master
    rested = Rested()
    rested.step()
    rested.env.pause()
    yield rested
    rested.close()


def test_what_has_rested_goes_on(rested):
    """Training pauses the simulators during an update, and continues with the next rollout."""
    mode = rested.simulator.webots.observer.mode()

    rested.env.unpause()

    assert mode is Mode.PAUSE
    assert rested.step()["palaestra"]["valid"]


@pytest.mark.parametrize(("number", "kind"), [(signal.SIGKILL, "dead"), (signal.SIGSTOP, "hung")])
def test_what_broke_while_it_rested_is_mended(rested, number, kind):
    """The request to resume a broken simulator fails, but the reported fault must be the simulator's own."""
    os.kill(rested.launcher.state().pid, number)

    rested.env.unpause()
    fault = rested.step()["palaestra"]["sim_fault"]

    assert fault["kind"] == kind
    eventually(lambda: rested.step()["palaestra"]["valid"], PATIENCE_S)
