"""Gymnasium environments, which the import of this package registers.

A program can run `import palaestra_trainer.environments` and then `gymnasium.make("MoveToTargetEnv-v0",
...)`. It can also do both in one call, `gymnasium.make("palaestra_trainer.environments:MoveToTargetEnv-v0",
...)`.
"""

import gymnasium

from palaestra_trainer.environments.deliver import DeliverEnv
from palaestra_trainer.environments.move_to_target import MoveToTargetEnv
from palaestra_trainer.environments.move_to_target_goal import MoveToTargetGoalEnv
from palaestra_trainer.environments.navigate import NavigateEnv
from palaestra_trainer.environments.options import (
    DeliverOptions,
    GoalOptions,
    MoveToTargetOptions,
    NavigateOptions,
    SeeOptions,
)
from palaestra_trainer.environments.see_target import SeeTargetEnv

__all__ = [
    "DeliverEnv",
    "DeliverOptions",
    "GoalOptions",
    "MoveToTargetEnv",
    "MoveToTargetGoalEnv",
    "MoveToTargetOptions",
    "NavigateEnv",
    "NavigateOptions",
    "SeeOptions",
    "SeeTargetEnv",
]

# Entry points are text, because the modules that they name import simulators, and this package must not
# import simulators. The environments count their steps themselves instead of setting max_episode_steps,
# because the reward `Sparse` depends on whether time is up.
gymnasium.register(
    id="MoveToTargetEnv-v0",
    entry_point="palaestra_trainer.simulators.entry_point:make",
    vector_entry_point="palaestra_trainer.simulators.entry_point:make_batched",
)
gymnasium.register(id="SeeTarget-v0", entry_point="palaestra_trainer.simulators.entry_point:make_seeing")
gymnasium.register(
    id="MoveToTargetGoalEnv-v0", entry_point="palaestra_trainer.simulators.entry_point:make_goal"
)
gymnasium.register(id="Deliver-v0", entry_point="palaestra_trainer.simulators.entry_point:make_delivering")
gymnasium.register(id="Navigate-v0", entry_point="palaestra_trainer.simulators.entry_point:make_navigating")
