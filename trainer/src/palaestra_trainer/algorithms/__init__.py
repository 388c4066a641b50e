"""The learning algorithms: Stable-Baselines3's, made safe against faults, and REINFORCE."""

from palaestra_trainer.algorithms.kept import begin_with, begun_with, keep
from palaestra_trainer.algorithms.normalization import normalizer_of, policy_of
from palaestra_trainer.algorithms.reinforce import REINFORCE
from palaestra_trainer.algorithms.rows import A2C, DQN, PPO, SAC
from palaestra_trainer.algorithms.table import ALGORITHMS, check, make_model

__all__ = [
    "A2C",
    "ALGORITHMS",
    "DQN",
    "PPO",
    "REINFORCE",
    "SAC",
    "begin_with",
    "begun_with",
    "check",
    "keep",
    "make_model",
    "normalizer_of",
    "policy_of",
]
