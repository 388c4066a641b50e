"""Saving and finding the state from which a run goes on, as if it had never ended.

A checkpoint is a folder `<step>/` with the model's tensors, its experience, everything else that its next
step depends on and, written last, a manifest with the digest of each file. It is made under a temporary
name and renamed, so it is there as a whole or not at all; one that was damaged later is skipped. Loading
unpickles nothing: the model is rebuilt from the configuration, tensors are read with `weights_only`, the
rest is JSON and plain arrays. How a resumed run comes to be the same: docs/decisions/0008-exact-resume.md.
"""

from palaestra_trainer.checkpoint.initial_policy import begin_from
from palaestra_trainer.checkpoint.manifest import Manifest, SavedCheckpoint, describe, refuse_another_run
from palaestra_trainer.checkpoint.state import TrainingState
from palaestra_trainer.checkpoint.store import Saver, newest, restore, tidy
from palaestra_trainer.checkpoint.tensors import Tensors, load_tensors, save_tensors

__all__ = [
    "Manifest",
    "SavedCheckpoint",
    "Saver",
    "Tensors",
    "TrainingState",
    "begin_from",
    "describe",
    "load_tensors",
    "newest",
    "refuse_another_run",
    "restore",
    "save_tensors",
    "tidy",
]
