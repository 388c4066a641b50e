"""Steps of a VecEnv in the corridor, and the end of a restart."""

from __future__ import annotations

import threading

import numpy as np

RIGHT, LEFT = 1, 0


def walk(env, steps, action=RIGHT):
    """Return the rows of some steps with the same action."""
    return [env.step(np.full(env.num_envs, action)) for _ in range(steps)]


def end_of_restart(name):
    """Wait for the end of the thread that restarts a simulator."""
    for thread in threading.enumerate():
        if thread.name == f"restarter-{name}":
            thread.join(20.0)
