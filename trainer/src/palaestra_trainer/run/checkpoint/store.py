"""Find the newest checkpoint of a run, and write a new checkpoint."""

from __future__ import annotations

import dataclasses
import errno
import re
import shutil
from collections.abc import Iterator
from pathlib import Path

import structlog
from stable_baselines3.common.base_class import BaseAlgorithm

from palaestra_protocol.whole_file import sync
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run.checkpoint import manifest, own_buffer, replay_store
from palaestra_trainer.run.checkpoint.manifest import Manifest, SavedCheckpoint, digest_of
from palaestra_trainer.run.checkpoint.state import TrainingState, replay_buffer
from palaestra_trainer.run.checkpoint.tensors import load_tensors, save_tensors

log = structlog.get_logger(__name__)

MODEL = "model.zip"
# File systems over object stores, for example, raise these errors when a folder is renamed.
_NO_RENAME = frozenset({errno.EPERM, errno.ENOTSUP, errno.ENOSYS, errno.EXDEV})
_NUMBER = re.compile(r"[0-9]{1,18}")


class Saver:
    """Writes the checkpoints of one attempt.

    Args:
        folder: the folder of the checkpoints; it may be missing.
        keep: number of newest checkpoints to keep.
        resumed: the checkpoint from which the attempt resumed; None: it did not resume.
    """

    def __init__(self, folder: Path, keep: int, resumed: SavedCheckpoint | None = None) -> None:
        self._folder = folder
        self._keep = keep
        self._before = resumed

    def save(self, model: BaseAlgorithm, state: TrainingState, described: Manifest) -> bool:
        """Set the model back to `state`, write a checkpoint, and remove old checkpoints.

        Returns whether the checkpoint was written. If the disk is full, this method logs an error, returns
        False and keeps the older checkpoints.

        Raises:
            ConfigurationError: the file system cannot rename folders.
            OSError: the checkpoint cannot be written, for another reason than a full disk.
        """
        state.put_back(model)
        draft = self._folder / f".{described.step}.draft"
        try:
            self._folder.mkdir(parents=True, exist_ok=True)
            tidy(self._folder)
            draft.mkdir()
            complete = self._write(draft, model, state, described)
            target = _put_in_place(draft)
        except (OSError, ConfigurationError) as error:
            shutil.rmtree(draft, ignore_errors=True)
            if not isinstance(error, OSError) or error.errno not in (errno.ENOSPC, errno.EDQUOT):
                raise
            log.error("checkpoint not written: disk full", step=described.step, folder=str(self._folder))
            return False
        self._before = SavedCheckpoint(path=target, manifest=complete)
        if buffer := replay_buffer(model):
            buffer.changed.clear()
        self._prune(described.step)
        return True

    def size_bytes(self) -> int:
        """Return the size of the newest checkpoint, including files that other checkpoints share.

        The size is 0 before the first checkpoint. It is also 0 if the files cannot be read, because such an
        error must not end the run.
        """
        newest = self._before
        if newest is None:
            return 0
        names = (*newest.manifest.files, manifest.MANIFEST)
        try:
            return sum((newest.path / name).stat().st_size for name in names)
        except OSError:
            return 0

    def _write(
        self, draft: Path, model: BaseAlgorithm, state: TrainingState, described: Manifest
    ) -> Manifest:
        save_tensors(draft / MODEL, model)
        state.write(draft)
        own_buffer.write(model, draft)
        files = {}
        for file in sorted(draft.iterdir()):
            sync(file)
            files[file.name] = digest_of(file)
        if buffer := replay_buffer(model):
            files |= replay_store.write(buffer, draft, self._before)
        complete = dataclasses.replace(described, files=files)
        complete.write(draft)
        sync(draft / manifest.MANIFEST)
        sync(draft)
        return complete

    def _prune(self, step: int) -> None:
        """Keep only the newest checkpoints up to `step`.

        Later checkpoints are removed: they are damaged, or the run has begun again since they were written.
        """
        reached = sorted((path for path in _steps(self._folder) if _step(path) <= step), key=_step)
        for path in set(_steps(self._folder)).difference(reached[-self._keep :]):
            shutil.rmtree(path, ignore_errors=True)


def newest(folder: Path) -> SavedCheckpoint | None:
    """Return the newest undamaged checkpoint; None if the folder has no checkpoints.

    This function does not change the folder. Checkpoints share chunks of experience, so a damaged chunk may
    affect all checkpoints. In that case, return the newest checkpoint whose other files are undamaged.

    Raises:
        ConfigurationError: this release cannot read the format of a checkpoint, or all checkpoints are
            damaged. The run must not start from the beginning, because it would replace these checkpoints.
    """
    rest, damage = None, ""
    for path in sorted(_steps(folder), key=_step, reverse=True):
        try:
            found = manifest.read(path)
        except ConfigurationError:
            raise
        except (OSError, ValueError, TypeError) as error:
            log.warning("damaged checkpoint skipped", path=str(path), fact=str(error))
            damage = damage or f"{path.name}: {error}"
            continue
        if not found.lost:
            return found
        log.warning(
            "damaged checkpoint skipped",
            path=str(path),
            fact=f"{len(found.lost)} files of experience are damaged",
        )
        rest = rest or found
    if rest:
        log.warning("all checkpoints are damaged: resuming without the lost experience", path=str(rest.path))
    elif damage:
        raise ConfigurationError(
            f"{folder}: no checkpoint in it can be read ({damage}); restore one from a copy, or move the run "
            "directory away to start a new run"
        )
    return rest


def restore(checkpoint: SavedCheckpoint, model: BaseAlgorithm) -> TrainingState:
    """Load tensors and experience of a checkpoint into a new model of the same configuration.

    Returns the rest of the state. Call `put_back` of this state last, directly before learning.

    Raises:
        ConfigurationError: the tensors are those of a different model.
    """
    load_tensors(checkpoint.path / MODEL, model)
    state = TrainingState.read(checkpoint.path)
    buffer = replay_buffer(model)
    if buffer and state.positions:
        buffer.positions = state.positions
        replay_store.read(buffer, checkpoint)
        state = dataclasses.replace(state, positions=buffer.positions)
    own_buffer.read(model, checkpoint.path)
    return state


def _put_in_place(draft: Path) -> Path:
    """Rename a complete draft to its final name, and then remove an older checkpoint of the same step."""
    name = draft.name.removeprefix(".").removesuffix(".draft")
    target, replaced = draft.with_name(name), draft.with_name(f".{name}.replaced")
    try:
        if target.exists():
            target.rename(replaced)
        draft.rename(target)
    except OSError as error:
        if error.errno not in _NO_RENAME:
            raise
        raise ConfigurationError(
            f"{draft.parent}: its file system cannot rename folders ({error.strerror}), so no checkpoint "
            "would be complete; use another volume, such as one of a block device or NFS"
        ) from error
    sync(draft.parent)
    shutil.rmtree(replaced, ignore_errors=True)
    return target


def tidy(folder: Path) -> None:
    """Finish or undo a write that a kill interrupted; call this function before a new write."""
    for draft in folder.glob(".*.draft"):
        shutil.rmtree(draft, ignore_errors=True)
    for replaced in folder.glob(".*.replaced"):
        target = folder / replaced.name.removeprefix(".").removesuffix(".replaced")
        if target.exists():
            shutil.rmtree(replaced, ignore_errors=True)
        else:
            replaced.rename(target)


def _steps(folder: Path) -> Iterator[Path]:
    if folder.is_dir():
        yield from (path for path in folder.iterdir() if path.is_dir() and _NUMBER.fullmatch(path.name))


def _step(path: Path) -> int:
    return int(path.name)
