"""Check a run directory before the attempt starts, writes or deletes anything.

A disk, a copy or a person may have damaged a file. Without this check, a run could end with a traceback hours
later, or lose the content of the file without a message. `journal.json` is not checked, because a run does
not need that file.
"""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run.best_record import BEST, RECORD

REMEDY = "restore it from a copy, or move the run directory away to start a new run"
_DATA = "data"
_Count = Annotated[int, Field(ge=0)]
_Rate = Annotated[float, Field(ge=0.0, le=1.0)] | None


class _Content(BaseModel):
    """The fields that a run needs; other fields are ignored."""

    model_config = ConfigDict(strict=True, extra="ignore")


class _Interval(_Content):
    low: Annotated[float, Field(ge=0.0, le=1.0)]
    high: Annotated[float, Field(ge=0.0, le=1.0)]
    episodes: Annotated[int, Field(ge=1)]


class _Evaluation(_Content):
    step: _Count
    success_rate: _Rate
    mean_return: float
    success_interval: _Interval | None = None


class _Confirmation(_Evaluation):
    confirmed_at: _Count
    episodes: _Count
    policy: str | None = None


class _Record(_Evaluation):
    policy: str
    episodes: _Count


class _Attempt(_Content):
    reason: str


class _Summary(_Content):
    target: _Count
    steps: _Count
    success_rate: _Rate
    success_interval: _Interval | None


def inspect(directory: RunDirectory) -> None:
    """Check that every existing file of a run directory can be read; the directory may be missing.

    Raises:
        ConfigurationError: a file is damaged; the message has one line for each damaged file.
    """
    if lines := [f"{path}: {fact}; {REMEDY}" for path, fact in _damages(directory)]:
        raise ConfigurationError("\n".join(lines))


class _Damaged(Exception):
    """A file is damaged; the message is the fact."""


def _damages(directory: RunDirectory) -> Iterator[tuple[Path, str]]:
    """Yield path and fact of each damaged file."""
    checks: dict[Path, Callable[[Path], None]] = {
        directory.checkpoints: _check_folder,
        directory.tensorboard: _check_folder,
        directory.configuration: _check_file,
        directory.evaluations: partial(_check_lines, kind=_Evaluation),
        directory.confirmations: partial(_check_lines, kind=_Confirmation),
        directory.attempts: partial(_check_lines, kind=_Attempt),
        directory.summary: partial(_check_document, kind=_Summary),
        directory.hyperparameters: partial(_check_document, kind=dict[str, Any]),
        directory.trackers: partial(_check_document, kind=dict[str, str]),
        directory.model: _check_model,
    }
    for path, check in checks.items():
        try:
            if path.exists():
                check(path)
        except _Damaged as damage:
            yield path, str(damage)
        except (OSError, ValueError, EOFError, zipfile.BadZipFile) as error:
            # For example, a number of 5,000 digits raises ValueError.
            yield path, f"cannot be read ({error})"


def _check_folder(path: Path) -> None:
    if not path.is_dir():
        raise _Damaged("is not a folder")


def _check_file(path: Path) -> None:
    if not path.is_file():
        raise _Damaged("is not a file")


def _check_lines(path: Path, kind: type[_Content]) -> None:
    """Check a file of JSON lines; ignore a line that a crash truncated, as all readers of the file do."""
    for number, line in enumerate(path.read_text(encoding="utf-8").splitlines(), start=1):
        try:
            content = json.loads(line)
        except json.JSONDecodeError:
            continue
        _check(content, kind, f"line {number}: ")


def _check_document(path: Path, kind: Any) -> None:
    _check(json.loads(path.read_text(encoding="utf-8")), kind)


def _check_model(path: Path) -> None:
    with zipfile.ZipFile(path) as archive:
        if damaged := archive.testzip():
            raise _Damaged(f"its file {damaged} is damaged")
        # A truncated file may end with the index of a zip inside it, and then looks complete.
        if _DATA not in archive.namelist():
            raise _Damaged(f"has no {_DATA}, as models of Stable-Baselines3 have")
        for name, kind in {BEST: _Evaluation, RECORD: _Record}.items():
            if name in archive.namelist():
                _check(json.loads(archive.read(name)), kind, f"{name} in it: ")


def _check(content: Any, kind: Any, where: str = "") -> None:
    """Check that content has a type; raise `_Damaged` with the first mistake."""
    try:
        TypeAdapter(kind).validate_python(content, strict=True)
    except ValidationError as error:
        first = error.errors()[0]
        field = "".join(f"{part}: " for part in first["loc"])
        raise _Damaged(f"{where}{field}{first['msg']}") from error
