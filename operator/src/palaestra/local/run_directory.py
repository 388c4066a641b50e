"""The run directory of one replica: its owner, the record of its job, and its outcome.

    <dir>/<job name>/<replica>/     job.yaml, training.yaml, worlds/, logs/, scratch/, outcome.json,
                                    and what the trainer writes: checkpoints/, tensorboard/, ...
    <dir>/<job name>/<replica>.lock held by the runner that uses the directory
    <dir>/<job name>/<replica>.log  the output of a runner in the background
    <dir>/<job name>/<replica>.old-<n>/   what --fresh or a correction has set aside; no run is ever deleted

The uid of a job on a laptop is derived from the path of its directory. So each `palaestra run` with this
directory has the same uid, and different directories have different uids. No file has to store the uid.
"""

import fcntl
import itertools
import os
import re
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from palaestra.api import TrainingJob, as_data, validate
from palaestra.api.fields import MAY_CHANGE
from palaestra.api.model_walk import fields_of, walk
from palaestra.api.paths import shown
from palaestra.errors import SpecErrors
from palaestra.local.errors import RunRefused
from palaestra.local.files import make_folder, storage, without_locks, write
from palaestra.local.outcome import RunOutcome
from palaestra_protocol.pod.status import ExitCode

RECORD = "job.yaml"
STEPS = "spec.trainer.steps"
_INDEX = re.compile(r"\[[0-9]+\]")

Record = Mapping[str, Any]


def _mutable() -> Iterator[str]:
    """Yield the fields that may differ between two runs of one directory.

    These fields affect the end of the training or the number of replicas, but never the learning of one
    replica.
    """
    yield from ("spec.backoffLimit", "spec.replicas")
    for path, model in walk(TrainingJob):
        for name, field in fields_of(model).items():
            if isinstance(field.json_schema_extra, dict) and MAY_CHANGE in field.json_schema_extra:
                yield shown((*path, name))


MUTABLE = frozenset(_mutable())  # in addition, `STEPS` may be raised, which prolongs the run


def job_directory(runs: Path, job: str) -> Path:
    """Return the absolute folder of a job below the folder of all runs."""
    return runs.absolute() / job


def uid_of(directory: Path) -> str:
    """Return the uid of the job whose runs are in `directory`; it depends only on the path."""
    return str(uuid.uuid5(uuid.NAMESPACE_URL, directory.absolute().as_uri()))


@contextmanager
def locked(directory: Path, taken: int | None = None) -> Iterator[int]:
    """Lock a run directory for this process, and yield the descriptor of the lock.

    The kernel releases the lock when every process with this descriptor has closed it or ended. A process
    that inherited the descriptor passes the descriptor as `taken`. Unlike the trainer's lock, this
    lock is not a record lock, because a child process cannot inherit a record lock.

    Raises:
        RunRefused: another runner has the lock, or the file system has no locks.
        StorageFailed: the parent folder cannot be written.
    """
    path = directory.with_name(f"{directory.name}.lock")
    descriptor = _take(directory, path) if taken is None else taken
    try:
        with storage(path):
            os.truncate(descriptor, 0)
            os.pwrite(descriptor, f"{os.getpid()}\n".encode(), 0)
        yield descriptor
    finally:
        os.close(descriptor)


def _take(directory: Path, path: Path) -> int:
    make_folder(directory.parent)
    with storage(path):
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        holder = os.read(descriptor, 32).decode(errors="replace").strip() or "unknown"
        os.close(descriptor)
        raise RunRefused(
            f"{directory}: is in use by `palaestra run` (process {holder}); "
            "wait until it ends, or choose another folder with --dir"
        ) from None
    except OSError as error:
        os.close(descriptor)
        raise RunRefused(without_locks(path, error)) from error
    return descriptor


def record_of(job: TrainingJob) -> dict[str, Any]:
    """Return the record of a job: its whole spec, including defaults."""
    return {field: value for field, value in as_data(job).items() if field != "status"}


def refuse_another_job(directory: Path, record: Record) -> None:
    """Compare a job with the record of the run in the directory.

    Raises:
        RunRefused: job and record differ in fields that a run cannot change, and the job is not a correction.
            The message has one line for each field.
    """
    changes = _changes(directory, record)
    if changes and not _learned_nothing(directory):
        raise RunRefused(
            "\n".join(changes) + f"\n{directory}: has a run of an earlier version of the job; "
            "undo the change in the file, give the job another name, or start a new run with --fresh"
        )


def is_correction(directory: Path, record: Record) -> bool:
    """Return whether a job corrects the job of a run that the trainer refused at step 0.

    Then the old directory must be set aside, because the trainer has stored the wrong hyperparameters in it.
    """
    return bool(_changes(directory, record)) and _learned_nothing(directory)


def is_prolonged(directory: Path, record: Record) -> bool:
    """Return whether a job has more steps than the record of the run in the directory."""
    before = _before(directory)
    return before is not None and _raised(dict(_flat(before)).get(STEPS), dict(_flat(record)).get(STEPS))


def _changes(directory: Path, record: Record) -> tuple[str, ...]:
    """Return the changed fields that must not change during a run; () without a run in the directory."""
    before = _before(directory)
    return () if before is None else tuple(changed_fields(before, record))


def _before(directory: Path) -> Record | None:
    """Return the record of the run in the directory; None without a run."""
    try:
        return _completed(yaml.safe_load((directory / RECORD).read_bytes()))
    except FileNotFoundError:
        return None


def _raised(was: Any, is_now: Any) -> bool:
    return isinstance(was, int) and isinstance(is_now, int) and is_now > was


def _learned_nothing(directory: Path) -> bool:
    """Return whether the trainer refused the job of a run at step 0, and the run has no checkpoint.

    If no step was reported, the result is False, because a custom program may have trained without a report.
    """
    outcome, checkpoints = RunOutcome.of(directory), directory / "checkpoints"
    return (
        outcome is not None
        and outcome.exit_code == ExitCode.CONFIGURATION
        and outcome.steps == 0
        and not (checkpoints.exists() and any(checkpoints.iterdir()))
    )


def changed_fields(before: Record, now: Record) -> Iterator[str]:
    """Yield `field: was x, is y` for each field that differs although a run cannot change it."""
    old, new = dict(_flat(before)), dict(_flat(now))
    for field in sorted(old.keys() | new.keys()):
        name, was, is_now = _INDEX.sub("", field), old.get(field), new.get(field)
        allowed = name in MUTABLE or (name == STEPS and _raised(was, is_now))
        if was != is_now and not allowed:
            remedy = "; it can only be raised, to prolong the run" if name == STEPS else ""
            yield f"{field}: was {_short(was)}, is {_short(is_now)}{remedy}"


def _completed(record: Any) -> Record:
    """Return the record of an older release, completed with the defaults of newer fields.

    A job that lacks a newer field equals the job with that field's default. If this release cannot read a
    record, for example because a newer release wrote it, the record is compared unchanged.
    """
    try:
        return record_of(validate(record))
    except SpecErrors:
        return record if isinstance(record, Mapping) else {}


def prepare(directory: Path, record: Record) -> None:
    """Create the directory, write the record of the job and remove the outcome of an earlier run.

    Raises:
        StorageFailed: the directory cannot be written.
    """
    RunOutcome.forget(directory)
    write(directory / RECORD, yaml.safe_dump(dict(record), sort_keys=False).encode())


def set_aside(directory: Path) -> Path | None:
    """Rename a run directory and return its new path; return None if it did not exist.

    Raises:
        StorageFailed: the directory cannot be renamed.
    """
    if not directory.exists():
        return None
    names = (directory.with_name(f"{directory.name}.old-{n}") for n in itertools.count(1))
    aside = next(name for name in names if not name.exists())
    with storage(directory):
        return directory.rename(aside)


def _flat(value: Any, path: str = "") -> Iterator[tuple[str, Any]]:
    match value:
        case dict() if value:
            for key, item in value.items():
                yield from _flat(item, f"{path}.{key}" if path else key)
        case list() if value:
            for index, item in enumerate(value):
                yield from _flat(item, f"{path}[{index}]")
        case _:
            yield path, value


_SHOWN = 40


def _short(value: Any) -> str:
    text = "absent" if value is None else repr(value)
    return text if len(text) <= _SHOWN else f"{text[: _SHOWN - 3]}..."
