"""Simulators step at the same time: four that sleep 3 ms a step against one."""

import tempfile
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from palaestra_trainer.environments.move_to_target import make
from palaestra_trainer.simulators.member import Keeper
from palaestra_trainer.simulators.vec_env import SimulatorsVecEnv
from tests.bench.arena import running
from tests.bench.stepping import rate

STEPS = 300
SLEEP_MS = 3
ARENA = Path(__file__).parents[2] / "sim_image/src/palaestra_sim/worlds/arena.wbt"


def measure():
    """Return environment steps per second of one and of four, and how many times the one the four are."""
    one, four = steps_per_second(1), steps_per_second(4)
    return {"one": round(one), "four": round(four), "times_one": round(four / one, 2)}


class Member:
    """A running simulator that is never restarted here."""

    def __init__(self, name, robot, scene):
        self.name = name
        self.env = make(robot, scene, max_steps=10_000)
        self.resets = 0

    def start(self):
        """It runs already."""

    def stop(self):
        """Others stop it."""

    def restart(self):
        """Refuse: a fault would spoil the measurement."""
        raise RuntimeError(f"{self.name} broke")

    def pause(self):
        """It is always busy."""

    def run(self):
        """It runs already."""


def steps_per_second(count):
    """Return environment steps per second of `count` simulators together, without a learner."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory()))
        members = []
        for number in range(count):
            name = f"parallel_{number}"
            world = folder / f"{name}.wbt"
            world.write_bytes(ARENA.read_bytes().replace(b"--name=robotino", f"--name={name}".encode()))
            robot, scene, _ = stack.enter_context(
                running(f"--step-sleep-ms={SLEEP_MS}", world=world, name=name)
            )
            members.append(Member(name, robot, scene))
        env = SimulatorsVecEnv([Keeper(member) for member in members], 0)
        stack.callback(env.close)
        env.reset()
        standing = np.zeros(count, dtype=np.int64)
        return count * rate(lambda: env.step(standing), STEPS)
