"""Option names of other projects, and the TrainingJob fields that replace them.

A user may write such a name as a field of a job or as a hyperparameter. The operator and the command line
check the fields, and the trainer checks the hyperparameters. Each error message has a remedy from
this table.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

_MEMORY = "in a run, its value is always false, because rows of all simulators share one buffer"
_VECTOR = "a run makes the vector environment itself; write wrappers as trainer.environment.wrappers"
_EVALUATION = "write trainer.evaluation"
_COUNT = "write the count of a group of spec.simulators with role Collect"
_STEPS = "write trainer.steps"
_NORMALIZE = "write trainer.algorithm.normalize"

# Some keys of this table are keys of RL-Baselines3-Zoo's files. Others are arguments that a run itself passes
# to a class of Stable-Baselines3. The remaining keys are arguments of `learn`, of a callback or of another
# library; fields of a job replace these arguments. The values are the remedies.
ELSEWHERE: Mapping[str, str] = MappingProxyType(
    {
        "_init_setup_model": "a run sets up its model itself; leave it out",
        "action_noise": "write noise_type and noise_std",
        "callback": "write trainer.algorithm.callbacks",
        "clip_obs": "write trainer.algorithm.normalize.clipObservations",
        "clip_reward": "write trainer.algorithm.normalize.clipRewards",
        "device": "the trainer uses a GPU if its resources request one; leave it out",
        "env": "write trainer.environment",
        "env_kwargs": "write trainer.environment.options",
        "env_wrapper": "write trainer.environment.wrappers",
        "eval_episodes": f"{_EVALUATION}.episodes",
        "eval_freq": f"{_EVALUATION}.everySteps",
        "frame_stack": "write trainer.environment.frameStack",
        "log_interval": "the log of a run contains all figures; leave it out",
        "max_episode_steps": "write trainer.environment.options.max_episode_steps",
        "max_steps": "write trainer.steps, or trainer.environment.options for the steps of an episode",
        "monitor_kwargs": "a run records return, length and is_success of every episode; leave it out",
        "n_envs": _COUNT,
        "n_eval_episodes": f"{_EVALUATION}.episodes",
        "n_timesteps": _STEPS,
        "norm_obs": f"{_NORMALIZE}.observations",
        "norm_reward": f"{_NORMALIZE}.rewards",
        "normalize": _NORMALIZE,
        "num_envs": _COUNT,
        "num_timesteps": _STEPS,
        "optimize_memory_usage": f"{_MEMORY}; leave it out",
        "policy": "write trainer.algorithm.policy",
        "progress_bar": "palaestra run and palaestra watch show the progress; leave it out",
        "save_freq": "write trainer.checkpoint.everySteps",
        "seed": "write spec.seed",
        "tensorboard_log": "every run directory has a folder tensorboard; leave it out",
        "timesteps": _STEPS,
        "total_timesteps": _STEPS,
        "vec_env_wrapper": _VECTOR,
        "verbose": "the log of a run contains all figures; leave it out",
    }
)
# The keys of `ELSEWHERE` that occur only in files of RL-Baselines3-Zoo.
OF_ZOO = frozenset(
    {
        "callback", "env_kwargs", "env_wrapper", "frame_stack", "monitor_kwargs", "n_envs", "n_timesteps",
        "normalize", "vec_env_wrapper",
    }
)  # fmt: skip
FROM_ZOO = "`palaestra from-zoo FILE` writes a job from a whole file of RL-Baselines3-Zoo"

_HINDSIGHT = (
    "HER is a replay buffer; use SAC, TD3, DDPG, TQC, DQN or QRDQN with replay_buffer_class: HerReplayBuffer"
)
# Algorithms of Stable-Baselines3 and sb3-contrib that a run does not support. Keys: names in lower case.
# Values: the reason and the remedy.
NO_ALGORITHM: Mapping[str, str] = MappingProxyType(
    {
        "ars": "ARS learns from whole returns, which would include rows of broken simulators; use another "
        "one",
        "her": _HINDSIGHT,
    }
)
