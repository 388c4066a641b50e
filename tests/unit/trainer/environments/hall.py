"""An environment of a user; tests change it, or make it break the contract of gymnasium."""

# ruff: noqa: ARG002 - gymnasium names the arguments of its methods

from __future__ import annotations

import gymnasium
import numpy as np
from gymnasium import spaces

NAME = "Hall-v0"


class Hall(gymnasium.Env):
    """An environment that keeps its arguments and returns the values of its class attributes."""

    observation_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
    action_space = spaces.Discrete(2)
    seen = (0.0, 0.0)
    dtype = np.float32
    reward = 1.0

    def __init__(self, robot, scene, size=4.0):
        self.given = {"robot": robot, "scene": scene, "size": size}

    def observe(self):
        """Return the observation."""
        return np.array(self.seen, self.dtype)

    def reset(self, *, seed=None, options=None):
        """Begin an episode."""
        super().reset(seed=seed)
        return self.observe(), {}

    def step(self, action):
        """Take a step."""
        return self.observe(), self.reward, False, False, {}
