"""The manifest of a checkpoint: its metadata, and digests to detect damaged files."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from pydantic import BaseModel, ValidationError

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Configuration

MANIFEST = "manifest.json"
EXPERIENCE = "experience"
FORMAT = 1
_NOT_COMPARED = {"callbacks"}  # a run may resume with other callbacks, because a model does not contain them


@dataclass(frozen=True, slots=True, kw_only=True)
class Manifest:
    """The metadata of a checkpoint.

    Attributes:
        step: number of valid environment steps that the model has learned from.
        seed: the replica's seed.
        algorithm: name and hyperparameters of the run.
        environment: id, reward, options and wrappers of the run's environment.
        counters: counters of the run, see `progress.Counters`.
        files: sha256 of each file of the checkpoint except the manifest.
        format: version of this format.
    """

    step: int
    seed: int
    algorithm: dict[str, Any]
    environment: dict[str, Any]
    counters: dict[str, Any] = field(default_factory=dict)
    files: dict[str, str] = field(default_factory=dict)
    format: int = FORMAT

    def write(self, folder: Path) -> None:
        """Write the manifest into a checkpoint's folder, with a digest of the manifest itself."""
        content = asdict(self)
        text = json.dumps(content | {"digest": _digest_of(content)}, indent=2)
        (folder / MANIFEST).write_text(text + "\n", encoding="utf-8")


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedCheckpoint:
    """A checkpoint whose files match its manifest.

    Attributes:
        path: folder of the checkpoint.
        manifest: manifest of the checkpoint.
        lost: files of experience that are damaged; all other files are undamaged.
    """

    path: Path
    manifest: Manifest
    lost: frozenset[str] = frozenset()


def describe(configuration: Configuration, step: int, counters: Mapping[str, Any]) -> Manifest:
    """Return the manifest of a checkpoint of this run, still without its list of files.

    Fields that are None are omitted. So an older release finds an unknown field only if the job sets that
    field.
    """
    return Manifest(
        step=step,
        seed=configuration.seed,
        algorithm=configuration.algorithm.model_dump(mode="json", exclude_none=True, exclude=_NOT_COMPARED),
        environment=configuration.environment.model_dump(mode="json", exclude_none=True),
        counters=dict(counters),
    )


def read(folder: Path) -> SavedCheckpoint:
    """Compare the files of a checkpoint with their digests, and return the checkpoint.

    Raises:
        OSError, ValueError, TypeError: a file other than experience is damaged.
        ConfigurationError: the checkpoint is undamaged, but this release cannot read its format.
    """
    manifest = _read_manifest(folder)
    damaged = [name for name, digest in manifest.files.items() if not _is(folder / name, digest)]
    for name in damaged:
        if not name.startswith(EXPERIENCE):
            raise ValueError(f"{name} does not match its digest in the manifest")
    return SavedCheckpoint(path=folder, manifest=manifest, lost=frozenset(damaged))


def digest_of(path: Path) -> str:
    """Return the sha256 of a file's contents."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def refuse_another_run(checkpoint: SavedCheckpoint, configuration: Configuration) -> None:
    """Check that the checkpoint's run has the algorithm and environment of this configuration.

    Raises:
        ConfigurationError: the checkpoint's run has another algorithm or environment.
    """
    for part in ("algorithm", "environment"):
        section: BaseModel = getattr(configuration, part)
        wanted = section.model_dump(mode="json", exclude=_NOT_COMPARED)
        saved = _completed(getattr(checkpoint.manifest, part), type(section))
        for key in wanted:
            if saved.get(key) != wanted[key]:
                raise ConfigurationError(
                    f"{part}.{key}: the run in {checkpoint.path.parent.parent} has "
                    f"{saved.get(key)!r}, not {wanted[key]!r}; use another run directory"
                )


def _completed(saved: dict[str, Any], section: type[BaseModel]) -> dict[str, Any]:
    """Return a section that an older release saved, with defaults for the fields that it did not have.

    A section of a newer release is returned unchanged.
    """
    try:
        return section.model_validate(saved).model_dump(mode="json")
    except ValidationError:
        return saved


def _read_manifest(folder: Path) -> Manifest:
    content = json.loads((folder / MANIFEST).read_text(encoding="utf-8"))
    if not isinstance(content, dict):
        raise TypeError(f"{MANIFEST} is not a JSON object")
    digest = content.pop("digest", None)
    whole = digest == _digest_of(content)
    number = content.get("format")
    if whole and number != FORMAT:
        raise ConfigurationError(
            f"{folder}: is of format {number}, unknown to this release, which reads {FORMAT}; "
            "continue with the release that wrote the checkpoint, or use another run directory"
        )
    if not whole:
        raise ValueError(f"{MANIFEST} does not match its digest")
    return Manifest(**content)


def _digest_of(content: Mapping[str, Any]) -> str:
    return hashlib.sha256(json.dumps(content, sort_keys=True).encode()).hexdigest()


def _is(path: Path, digest: str) -> bool:
    try:
        return digest_of(path) == digest
    except OSError:
        return False
