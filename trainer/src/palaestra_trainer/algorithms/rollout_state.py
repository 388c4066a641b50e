"""For each algorithm, the state that a rollout changes and a resume needs, besides the saved tensors.

Every algorithm counts steps, and keeps its last observation and statistics of episodes. `checkpoint.state`
saves these values and the action noise. The table of this module lists the rest for each class: networks that
a rollout changes, the state of an LSTM, and counts. A user's class has the entry of its nearest ancestor in
the table. Without such an ancestor, the whole policy is copied at each boundary between rollouts, because a
rollout may change any network.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

import sb3_contrib
import stable_baselines3 as sb3
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_trainer.algorithms.reinforce import REINFORCE


@dataclass(frozen=True, slots=True, kw_only=True)
class RolloutState:
    """The attributes that a rollout of an algorithm changes, besides those that every algorithm has.

    Attributes:
        networks: names of networks with tensors that a rollout changes; an update may change these tensors
            too.
        memories: names of the states of recurrent networks; a state is a nested tuple of tensors of shape
            (layers, members, units).
        numbers: names of counts of the algorithm, and of numbers that the algorithm derives from its counts.
    """

    networks: tuple[str, ...] = ()
    memories: tuple[str, ...] = ()
    numbers: tuple[str, ...] = ()


_NOTHING = RolloutState()
_UNKNOWN = RolloutState(networks=("policy",))
_EXPLORATION = ("exploration_rate", "_n_calls")
ROLLOUT_STATES: Mapping[type[BaseAlgorithm], RolloutState] = MappingProxyType(
    {
        sb3.DQN: RolloutState(networks=("q_net_target",), numbers=_EXPLORATION),
        sb3_contrib.QRDQN: RolloutState(networks=("quantile_net_target",), numbers=_EXPLORATION),
        sb3_contrib.RecurrentPPO: RolloutState(memories=("_last_lstm_states",)),
        **dict.fromkeys(
            (
                sb3.PPO,
                sb3.A2C,
                sb3.SAC,
                sb3.TD3,  # also for DDPG, which is a subclass
                sb3_contrib.TQC,
                sb3_contrib.TRPO,
                sb3_contrib.CrossQ,
                sb3_contrib.MaskablePPO,
                REINFORCE,
            ),
            _NOTHING,
        ),
    }
)


def rollout_state_of(model: BaseAlgorithm) -> RolloutState:
    """Return the entry of the model's class, or of the nearest ancestor in the table."""
    known = (ROLLOUT_STATES[cls] for cls in type(model).__mro__ if cls in ROLLOUT_STATES)
    return next(known, _UNKNOWN)
