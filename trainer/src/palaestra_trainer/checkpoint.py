"""Saving and finding the state from which a run can go on.

A checkpoint is a folder `<step>/` with tensors, the replay buffer and, written
last, a manifest with the digest of each file. It is made under a temporary
name and renamed, so it is there as a whole or not at all; one that was damaged
later is skipped. Loading unpickles nothing: the model is rebuilt from the
configuration, tensors are read with `weights_only`, buffers are plain arrays.
"""

from __future__ import annotations

import errno
import hashlib
import json
import shutil
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import structlog
import torch
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.save_util import load_from_zip_file, recursive_setattr

from palaestra_trainer.algorithms.buffers import ValidReplayBuffer
from palaestra_trainer.configuration import Configuration
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run_directory import sync

log = structlog.get_logger(__name__)

MANIFEST = "manifest.json"
MODEL = "model.zip"
REPLAY = "replay.npz"
FORMAT = 1
# What the algorithms count besides their steps; each is kept if the model has it.
_COUNTS = ("_n_updates", "_n_calls", "_episode_num")


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """What a checkpoint says of itself.

    Attributes:
        step: valid environment steps learned from.
        episodes: for each collecting simulator the number of its next episode.
        seed: the replica's seed.
        algorithm: name and hyperparameters it was made with.
        environment: id, reward and options it was made with.
        counts: counters of the algorithm.
        counters: counters of the run, see `progress.Counters`.
        files: sha256 of each file beside the manifest.
        format: version of this layout.
    """

    step: int
    episodes: list[int]
    seed: int
    algorithm: dict[str, Any]
    environment: dict[str, Any]
    counts: dict[str, int] = field(default_factory=dict)
    counters: dict[str, Any] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    format: int = FORMAT


@dataclass(frozen=True, slots=True, kw_only=True)
class Checkpoint:
    """A checkpoint whose files are what its manifest says."""

    path: Path
    manifest: Manifest


def describe(
    configuration: Configuration, step: int, episodes: list[int], counters: Mapping[str, Any]
) -> Manifest:
    """Return the manifest of a checkpoint of this run, without what `save` adds."""
    return Manifest(
        step=step,
        episodes=episodes,
        seed=configuration.seed,
        algorithm=configuration.algorithm.model_dump(mode="json"),
        environment=configuration.environment.model_dump(mode="json"),
        counters=dict(counters),
    )


def save(folder: Path, model: BaseAlgorithm, manifest: Manifest, keep: int) -> bool:
    """Write a checkpoint into `folder` and remove all but the `keep` newest.

    Returns whether it was written: a full disk is logged, and leaves those that
    were there as they were.

    Raises:
        OSError: it cannot be written for another reason than a full disk.
    """
    draft = folder / f".{manifest.step}.draft"
    try:
        folder.mkdir(parents=True, exist_ok=True)
        _remove_drafts(folder)
        draft.mkdir()
        _write(draft, model, manifest)
        target = folder / str(manifest.step)
        if target.exists():
            shutil.rmtree(target)
        draft.rename(target)
        sync(folder)
    except OSError as error:
        shutil.rmtree(draft, ignore_errors=True)
        if error.errno not in (errno.ENOSPC, errno.EDQUOT):
            raise
        log.error("checkpoint not written: disk full", step=manifest.step, folder=str(folder))  # noqa: TRY400 - one clear line
        return False
    for old in sorted(_steps(folder), key=lambda path: int(path.name))[:-keep]:
        shutil.rmtree(old, ignore_errors=True)
    return True


def newest(folder: Path) -> Checkpoint | None:
    """Return the newest checkpoint that is undamaged; None if there is none."""
    for path in sorted(_steps(folder), key=lambda path: int(path.name), reverse=True):
        try:
            return Checkpoint(path=path, manifest=_verified(path))
        except (OSError, ValueError, TypeError, KeyError) as error:
            log.warning("damaged checkpoint skipped", path=str(path), fact=str(error))
    return None


def restore(checkpoint: Checkpoint, model: BaseAlgorithm, configuration: Configuration) -> None:
    """Put the state of a checkpoint into a new model of the same configuration.

    Raises:
        ConfigurationError: the checkpoint is of another algorithm or environment.
    """
    manifest = checkpoint.manifest
    _refuse_another_run(checkpoint, configuration)
    load_tensors(checkpoint.path / MODEL, model)
    for name, value in manifest.counts.items():
        setattr(model, name, value)
    model.num_timesteps = manifest.step
    buffer = getattr(model, "replay_buffer", None)
    if isinstance(buffer, ValidReplayBuffer) and (checkpoint.path / REPLAY).exists():
        with np.load(checkpoint.path / REPLAY, allow_pickle=False) as arrays:
            buffer.fill(dict(arrays))


def load_tensors(path: Path, model: BaseAlgorithm) -> None:
    """Put the tensors of a Stable-Baselines3 zip into `model`; nothing is unpickled.

    Raises:
        ConfigurationError: they are of another kind of model.
    """
    try:
        _, parameters, variables = load_from_zip_file(path, device=model.device, load_data=False)
        model.set_parameters(parameters, exact_match=True, device=model.device)
    except (AttributeError, RuntimeError, ValueError) as error:
        raise ConfigurationError(
            f"{path}: does not fit {type(model).__name__} as configured ({error}); "
            "use the configuration it was trained with"
        ) from error
    for name, value in (variables or {}).items():
        if value is not None:
            recursive_setattr(model, f"{name}.data", value.data)


def finite(model: BaseAlgorithm) -> bool:
    """Return whether every parameter of the model's networks is a finite number."""
    return all(bool(torch.isfinite(parameter).all()) for parameter in model.policy.parameters())


def _write(draft: Path, model: BaseAlgorithm, manifest: Manifest) -> None:
    model.save(draft / MODEL)
    buffer = getattr(model, "replay_buffer", None)
    if isinstance(buffer, ValidReplayBuffer):
        np.savez(draft / REPLAY, allow_pickle=False, **buffer.arrays())
    for file in draft.iterdir():
        sync(file)
    complete = asdict(manifest) | {
        "files": {file.name: _digest(file) for file in sorted(draft.iterdir())},
        "counts": {name: getattr(model, name) for name in _COUNTS if hasattr(model, name)},
    }
    (draft / MANIFEST).write_text(json.dumps(complete, indent=2) + "\n", encoding="utf-8")
    sync(draft / MANIFEST)
    sync(draft)


def _verified(path: Path) -> Manifest:
    content = json.loads((path / MANIFEST).read_text(encoding="utf-8"))
    if not isinstance(content, dict) or content.get("format") != FORMAT:
        raise ValueError(f"its manifest is not one of format {FORMAT}")
    manifest = Manifest(**content)
    for name, digest in manifest.files.items():
        if _digest(path / name) != digest:
            raise ValueError(f"{name} is not what the manifest says")
    return manifest


def _refuse_another_run(checkpoint: Checkpoint, configuration: Configuration) -> None:
    was = describe(configuration, 0, [], {})
    for part in ("algorithm", "environment"):
        saved, wanted = getattr(checkpoint.manifest, part), getattr(was, part)
        for key in wanted:
            if saved.get(key) != wanted[key]:
                raise ConfigurationError(
                    f"{part}.{key}: the run in {checkpoint.path.parent.parent} has "
                    f"{saved.get(key)!r}, not {wanted[key]!r}; use another run directory"
                )


def _digest(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _steps(folder: Path) -> Iterator[Path]:
    if folder.is_dir():
        yield from (path for path in folder.iterdir() if path.is_dir() and path.name.isdigit())


def _remove_drafts(folder: Path) -> None:
    for draft in folder.glob(".*.draft"):
        shutil.rmtree(draft, ignore_errors=True)
