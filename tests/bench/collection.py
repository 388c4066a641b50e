"""Collecting from several simulators: synchronously, asynchronously, and with SubprocVecEnv's processes.

The actions are fixed, so no time is spent on a policy. Each simulator is a stub that sleeps in each step. A
process of Stable-Baselines3's `SubprocVecEnv` uses the same facade of the robot as our vector environments.
"""

import itertools
import statistics
import tempfile
import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
from stable_baselines3.common.vec_env import SubprocVecEnv

from palaestra_trainer.episodes.asynchronous_vec_env import AsynchronousVecEnv
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.simulators.restarter import Restarter
from tests.bench.arena import running
from tests.bench.parallel import ARENA, MOVEMENTS, Member
from tests.bench.sizes import scaled

SLEEPS_MS = (1, 3, 10, 30)
COUNTS = (1, 2, 4, 8)
SECONDS = 2.0
LEAST_SECONDS = 0.1
ROUNDS = 5
FAST, FAST_MS, SLOW_MS = 3, 3, 30


def measure(scale=1.0):
    """Return the steps per second of each way, and the shares of `beside_a_slow_one`."""
    seconds = max(SECONDS * scale, LEAST_SECONDS)
    counts, sleeps = COUNTS[: scaled(len(COUNTS), scale)], SLEEPS_MS[: scaled(len(SLEEPS_MS), scale)]
    found = {
        f"{count} of {sleep_ms} ms": measured(count, sleep_ms, seconds)
        for count, sleep_ms in itertools.product(counts, sleeps)
    }
    return {"steps_per_second": found, "beside_a_slow_one": beside_a_slow_one(scale, seconds)}


def measured(count, sleep_ms, seconds):
    """Return the steps per second of `count` simulators, by the way of collecting."""
    with ExitStack() as stack:
        members = [started(stack, f"bench_{number}", sleep_ms) for number in range(count)]
        ours = rate(vector(stack, SimulatorsVecEnv, members), seconds)
        asynchronous = rate(vector(stack, AsynchronousVecEnv, members), seconds)
    with ExitStack() as stack:
        processes = [in_a_process(f"bench_{number}", sleep_ms) for number in range(count)]
        theirs = SubprocVecEnv(processes)
        stack.callback(theirs.close)
        others = rate(theirs, seconds)
    return {
        "synchronous": round(ours),
        "asynchronous": round(asynchronous),
        "subproc": round(others),
        "times_subproc": round(ours / others, 2),
        "efficiency": round(ours * sleep_ms / 1000 / count, 2),
    }


def beside_a_slow_one(scale, seconds):
    """Return the rate of three fast simulators that collect together with a slow one.

    The rate is a share of the rate that the three have without the slow simulator, by the way of collecting.
    """
    shares = {"synchronous": [], "asynchronous": []}
    with ExitStack() as stack:
        fast = [started(stack, f"fast_{number}", FAST_MS) for number in range(FAST)]
        slow = started(stack, "slow", SLOW_MS)
        for _ in range(scaled(ROUNDS, scale)):
            for way, cls in (("synchronous", SimulatorsVecEnv), ("asynchronous", AsynchronousVecEnv)):
                alone = rate(cls([Restarter(member) for member in fast], 0), seconds)
                mixed = cls([Restarter(member) for member in (*fast, slow)], 0)
                shares[way].append(rate(mixed, seconds, FAST) / alone)
    return {way: round(statistics.median(found), 2) for way, found in shares.items()}


def rate(env, seconds, rows=None):
    """Return the valid rows per second of the first `rows` members (None: all), with fixed actions."""
    env.reset()
    actions = itertools.cycle(np.full(env.num_envs, number) for number in range(len(MOVEMENTS)))
    count, began = 0, time.perf_counter()
    while (now := time.perf_counter()) < began + seconds:
        *_, infos = env.step(next(actions))
        count += sum(info.get("palaestra", {}).get("valid", True) for info in infos[:rows])
    if isinstance(env, AsynchronousVecEnv):
        env.pause()  # waits for the pending steps; the simulators of this measurement are never paused
    return count / (now - began)


def vector(stack, cls, members):
    """Return a vector environment of our members, which the stack closes."""
    env = cls([Restarter(member) for member in members], 0)
    stack.callback(env.close)
    return env


def started(stack, name, sleep_ms):
    """Return a member whose simulator runs until the stack is closed."""
    world = Path(stack.enter_context(tempfile.TemporaryDirectory())) / f"{name}.wbt"
    world.write_bytes(ARENA.read_bytes().replace(b"--name=robotino", f"--name={name}".encode()))
    robot, scene, _ = stack.enter_context(running(f"--step-sleep-ms={sleep_ms}", world=world, name=name))
    return Member(name, robot, scene)


def in_a_process(name, sleep_ms):
    """Return a function that starts a simulator and makes its environment, in a process of SubprocVecEnv."""

    def env():
        stack = ExitStack()
        member = started(stack, name, sleep_ms)
        close = member.env.close
        member.env.close = lambda: (close(), stack.close())
        return member.env

    return env
