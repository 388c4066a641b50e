"""Save and restore the state of a run, so that a resumed run continues as if it had never ended.

A checkpoint is a folder `<step>/` with the model's tensors, its experience, and the rest of the state that
the next step depends on. A manifest with the digest of each file is written last. The folder has a temporary
name until all files are written, so every checkpoint is complete. A checkpoint that was damaged later is
skipped. Loading does not unpickle. The trainer creates the model from the configuration, reads tensors with
`weights_only`, and reads the rest from JSON and plain arrays. docs/decisions/0008-exact-resume.md explains
exact resumes.
"""

from palaestra_trainer.run.checkpoint.initial_policy import begin_from
from palaestra_trainer.run.checkpoint.manifest import Manifest, SavedCheckpoint, describe, refuse_another_run
from palaestra_trainer.run.checkpoint.state import TrainingState
from palaestra_trainer.run.checkpoint.store import Saver, newest, restore, tidy
from palaestra_trainer.run.checkpoint.tensors import (
    Tensors,
    digest_of_policy,
    load_tensors,
    save_tensors,
)

__all__ = [
    "Manifest",
    "SavedCheckpoint",
    "Saver",
    "Tensors",
    "TrainingState",
    "begin_from",
    "describe",
    "digest_of_policy",
    "load_tensors",
    "newest",
    "refuse_another_run",
    "restore",
    "save_tensors",
    "tidy",
]
