"""The base of all Stable-Baselines3 VecEnvs of this package: access to the members' environments."""

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
    """A VecEnv of members; a subclass defines how the members step.

    Args:
        restarters: the restarter of each member; rows have the same order.

    Attributes:
        asynchronous: whether a step may return while the steps of some members have not ended.
    """

    asynchronous = False

    def __init__(self, restarters: Sequence[Restarter]) -> None:
        self._restarters = list(restarters)
        env = restarters[0].member.env
        super().__init__(len(restarters), env.observation_space, env.action_space)
        self._actions = np.empty(0)

    def step_async(self, actions: np.ndarray) -> None:
        """Store `actions`, one for each member, until `step_wait`."""
        self._actions = actions

    def get_attr(self, attr_name: str, indices: VecEnvIndices = None) -> list[Any]:
        """Return an attribute of each chosen environment, even if an inner wrapper defines it."""
        return [env.get_wrapper_attr(attr_name) for env in self._targets(indices)]

    def set_attr(self, attr_name: str, value: Any, indices: VecEnvIndices = None) -> None:
        """Set an attribute on the wrapper that has it, or else on the innermost environment.

        The VecEnvs of Stable-Baselines3 set attributes on the outermost wrapper, where the environment cannot
        read them. The attribute stays set after a restart of the simulator, and a standby gets the same
        value.
        """
        for index in self._get_indices(indices):
            self._restarters[index].set_attribute(attr_name, value)

    def env_method(
        self, method_name: str, *method_args: Any, indices: VecEnvIndices = None, **method_kwargs: Any
    ) -> list[Any]:
        """Return the result of a method of each chosen environment."""
        return [
            env.get_wrapper_attr(method_name)(*method_args, **method_kwargs) for env in self._targets(indices)
        ]

    def env_is_wrapped(
        self, wrapper_class: type[gymnasium.Wrapper[Any, Any, Any, Any]], indices: VecEnvIndices = None
    ) -> list[bool]:
        """Return for each chosen environment whether it is wrapped in `wrapper_class`."""
        return [is_wrapped(env, wrapper_class) for env in self._targets(indices)]

    def get_images(self) -> Sequence[np.ndarray | None]:
        """Return an image of each environment; warn and return None for an environment without images."""
        if self.render_mode != "rgb_array":
            warnings.warn(f"render_mode: is {self.render_mode}; only rgb_array gives images", stacklevel=2)
            return [None] * self.num_envs
        return [cast("np.ndarray | None", env.render()) for env in self._targets(None)]

    def _targets(self, indices: VecEnvIndices) -> list[Environment]:
        return [self._restarters[index].member.env for index in self._get_indices(indices)]

    def _stack(self, observations: list[Any]) -> VecEnvObs:
        if isinstance(self.observation_space, spaces.Dict):
            return {
                key: np.array([observation[key] for observation in observations])
                for key in self.observation_space.spaces
            }
        return np.array(observations)
