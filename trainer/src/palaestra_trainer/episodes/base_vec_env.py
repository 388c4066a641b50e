"""The part of a Stable-Baselines3 VecEnv that every vector of members has: access to their environments."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any, cast

import gymnasium
import numpy as np
from gymnasium import spaces
from stable_baselines3.common.env_util import is_wrapped
from stable_baselines3.common.vec_env import VecEnv
from stable_baselines3.common.vec_env.base_vec_env import VecEnvIndices, VecEnvObs

from palaestra_trainer.simulators.interface import Environment
from palaestra_trainer.simulators.restarter import Restarter


class MembersVecEnv(VecEnv):
    """A VecEnv of members; how they step is up to the subclass.

    Args:
        keepers: one for each member; rows are in their order.
    """

    def __init__(self, keepers: Sequence[Restarter]) -> None:
        self._keepers = list(keepers)
        env = keepers[0].member.env
        super().__init__(len(keepers), env.observation_space, env.action_space)
        self._actions = np.empty(0)

    def step_async(self, actions: np.ndarray) -> None:
        """Keep `actions`, one for each member, for `step_wait`."""
        self._actions = actions

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of the chosen environments, also one behind wrappers."""
        return [env.get_wrapper_attr(attr_name) for env in self._targets(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute of the chosen environments, in the wrapper that defines it or behind all of them.

        Stable-Baselines3's own vectors set it in the outermost wrapper, where no environment sees it. A
        restarted simulator keeps it, and a standby gets it.
        """
        for index in self._get_indices(indices):
            self._keepers[index].set_attribute(attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Return what a method of the chosen environments returns."""
        return [
            env.get_wrapper_attr(method_name)(*method_args, **method_kwargs) for env in self._targets(indices)
        ]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return for each chosen environment whether it is wrapped in `wrapper_class`."""
        return [is_wrapped(env, wrapper_class) for env in self._targets(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return an image of each environment; None of all, and a warning, if they do not draw arrays."""
        if self.render_mode != "rgb_array":
            warnings.warn(f"render_mode: is {self.render_mode}; only rgb_array gives images", stacklevel=2)
            return [None] * self.num_envs
        return [cast("np.ndarray | None", env.render()) for env in self._targets(None)]

    def _targets(self, indices: VecEnvIndices) -> list[Environment]:
        return [self._keepers[index].member.env for index in self._get_indices(indices)]

    def _stack(self, observations: list[Any]) -> VecEnvObs:
        if isinstance(self.observation_space, spaces.Dict):
            return {
                key: np.array([observation[key] for observation in observations])
                for key in self.observation_space.spaces
            }
        return np.array(observations)
