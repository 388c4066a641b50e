"""The algorithms of Stable-Baselines3, sb3-contrib and users, changed to learn only from valid rows."""

from palaestra_trainer.algorithms.ineffective_settings import futile
from palaestra_trainer.algorithms.make_model import check, make_model
from palaestra_trainer.algorithms.masks import is_masked, refuse_without_masks, takes_masks
from palaestra_trainer.algorithms.model_policy import ModelPolicy
from palaestra_trainer.algorithms.normalization import normalizer_of
from palaestra_trainer.algorithms.registry import ALGORITHMS, entry_of
from palaestra_trainer.algorithms.reinforce import REINFORCE
from palaestra_trainer.algorithms.saved_hyperparameters import begin_with, begun_with, keep
from palaestra_trainer.algorithms.space_compat import refuse_spaces

__all__ = [
    "ALGORITHMS",
    "REINFORCE",
    "ModelPolicy",
    "begin_with",
    "begun_with",
    "check",
    "entry_of",
    "futile",
    "is_masked",
    "keep",
    "make_model",
    "normalizer_of",
    "refuse_spaces",
    "refuse_without_masks",
    "takes_masks",
]
