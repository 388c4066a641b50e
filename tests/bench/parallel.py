"""Four simulators that step in parallel, compared with one simulator in each round.

Each simulator sleeps for 3 ms in each step.
"""

import itertools
import statistics
import tempfile
from contextlib import ExitStack
from pathlib import Path

import numpy as np

from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.entry_point import make
from palaestra_trainer.simulators.restarter import Restarter
from tests.bench.arena import running
from tests.bench.sizes import scaled
from tests.bench.stepping import rate

ROUNDS = 15
STEPS = 200
SLEEP_MS = 3
# Every wheel changes direction at every step, because the facade does not send an unchanged command again.
MOVEMENTS = ("TURN_LEFT", "TURN_RIGHT")
ARENA = Path(__file__).parents[2] / "sim_image/src/palaestra_sim/worlds/arena.wbt"


def measure(scale=1.0):
    """Return the environment steps per second of one and of four simulators, and the ratio."""
    with ExitStack() as stack:
        members = [started(stack, f"parallel_{number}") for number in range(4)]
        one, four = vector(stack, members[:1]), vector(stack, members)
        steps = scaled(STEPS, scale)
        rounds = [
            (steps_per_second(one, steps), steps_per_second(four, steps))
            for _ in range(scaled(ROUNDS, scale))
        ]
    ratios = sorted(four / one for one, four in rounds)
    return {
        "one": round(statistics.median(one for one, _ in rounds)),
        "four": round(statistics.median(four for _, four in rounds)),
        "times_one": round(statistics.median(ratios), 2),
        "least": round(ratios[0], 2),
        "most": round(ratios[-1], 2),
    }


class Member:
    """A running simulator that is never restarted in this measurement."""

    def __init__(self, name, robot, scene):
        self.name = name
        self.env = make(robot, scene, movements=MOVEMENTS, max_steps=10_000)
        self.resets = 0

    def start(self):
        """Do nothing, because the simulator already runs."""

    def due(self, episodes=1):
        """Return None, because a short measurement needs no restart."""

    def abandon(self):
        """Do nothing, because the simulator is never restarted."""

    def stop(self):
        """Do nothing, because the exit stack stops the simulator."""

    def restart(self):
        """Raise an error, because a restart would spoil the measurement."""
        raise RuntimeError(f"{self.name} broke")

    def pause(self):
        """Do nothing, because the simulator is always busy."""

    def unpause(self):
        """Do nothing, because the simulator is never paused."""


def started(stack, name):
    """Return a member whose simulator, with a name of its own, runs until `stack` is closed."""
    world = Path(stack.enter_context(tempfile.TemporaryDirectory())) / f"{name}.wbt"
    world.write_bytes(ARENA.read_bytes().replace(b"--name=robotino", f"--name={name}".encode()))
    robot, scene, _ = stack.enter_context(running(f"--step-sleep-ms={SLEEP_MS}", world=world, name=name))
    return Member(name, robot, scene)


def vector(stack, members):
    """Return the vector environment of some members."""
    env = SimulatorsVecEnv([Restarter(member) for member in members], 0)
    stack.callback(env.close)
    return env


def steps_per_second(env, steps):
    """Return the environment steps per second of all members together, without a learner."""
    env.reset()
    actions = itertools.cycle(np.full(env.num_envs, number) for number in range(len(MOVEMENTS)))
    return env.num_envs * rate(lambda: env.step(next(actions)), steps)
