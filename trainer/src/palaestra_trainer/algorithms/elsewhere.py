"""Words that other projects write beside hyperparameters, and their places in a TrainingJob."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

_BUFFER = "a run has buffers of its own, which keep rows of broken simulators out of every loss; leave it out"
_VECTOR = "wrap the environment in its entry point; leave it out"

# Words of RL-Zoo's files, and arguments of Stable-Baselines3's classes that a run itself gives.
ELSEWHERE: Mapping[str, str] = MappingProxyType(
    {
        "action_noise": "write noise_type and noise_std",
        "callback": "write trainer.algorithm.callbacks",
        "device": "the trainer takes the GPU that its resources ask for; leave it out",
        "env": "write trainer.environment",
        "env_wrapper": _VECTOR,
        "frame_stack": _VECTOR,
        "n_envs": "write the count of a group of spec.simulators with role Collect",
        "n_timesteps": "write trainer.steps",
        "normalize": "write trainer.algorithm.normalize",
        "optimize_memory_usage": _BUFFER,
        "policy": "write trainer.algorithm.policy",
        "rollout_buffer_class": _BUFFER,
        "rollout_buffer_kwargs": _BUFFER,
        "seed": "write spec.seed",
        "tensorboard_log": "every run directory has a folder tensorboard; leave it out",
        "vec_env_wrapper": _VECTOR,
        "verbose": "the log of a run has every figure; leave it out",
    }
)
