"""Save the state of a run, and find it again, so that a resumed run continues as if it had never ended.

A checkpoint is a folder `<step>/` with the model's tensors, its experience, and the rest of the state that
the next step depends on. A manifest with the digest of each file is written last. The folder is written under
a temporary name and renamed, so a checkpoint is complete or absent; one that was damaged later is skipped.
Loading does not unpickle: the model is rebuilt from the configuration, tensors are read with `weights_only`,
and the rest is JSON and plain arrays. docs/decisions/0008-exact-resume.md explains exact resumes.
"""

from palaestra_trainer.run.checkpoint.initial_policy import begin_from
from palaestra_trainer.run.checkpoint.manifest import Manifest, SavedCheckpoint, describe, refuse_another_run
from palaestra_trainer.run.checkpoint.state import TrainingState
from palaestra_trainer.run.checkpoint.store import Saver, newest, restore, tidy
from palaestra_trainer.run.checkpoint.tensors import Tensors, load_tensors, save_tensors

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
