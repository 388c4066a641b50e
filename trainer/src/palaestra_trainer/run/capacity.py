"""Measure the available memory and disk space, and check that a run's replay buffer fits.

The trainer reads the memory limit of its container from the control group, so the job need not pass
`limits.memory` to the trainer. Without a limit, the machine's available memory counts. The file system
reports the free space of a volume.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from palaestra_trainer.algorithms.replay_size import ReplaySize
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Checkpoint
from palaestra_trainer.job.run_directory import RunDirectory

# The reserve is for the batches of an update, for evaluations, and for writing a checkpoint. All of these
# together need far less.
RESERVE_BYTES = 128 << 20
CONTROL_GROUPS = Path("/sys/fs/cgroup")
_KIB = 1024
_GB = 10**9


@dataclass(frozen=True, slots=True, kw_only=True)
class Capacity:
    """The space that is available for a replay buffer.

    Attributes:
        memory_bytes: memory that this process may still allocate; None: unknown.
        memory_limit: whether `memory_bytes` follows from a limit of the container or of another control
            group.
        disk_bytes: space for checkpoints on the volume of the run directory, including the space of existing
            checkpoints.
    """

    memory_bytes: int | None
    memory_limit: bool
    disk_bytes: int


def capacity_now(
    directory: RunDirectory, *, groups: Path = CONTROL_GROUPS, processes: Path = Path("/proc")
) -> Capacity:
    """Return the space that is available now.

    Args:
        directory: the run directory, which must exist.
        groups: the folder at which the control groups are mounted.
        processes: the folder of the proc file system, with the machine's memory and the control group of this
            process.
    """
    machine = _available(processes / "meminfo")
    limited = min(_left_in_groups(groups, processes / "self" / "cgroup"), default=None)
    found = [left for left in (machine, limited) if left is not None]
    return Capacity(
        memory_bytes=max(min(found) - RESERVE_BYTES, 0) if found else None,
        memory_limit=limited is not None and limited == min(found),
        disk_bytes=shutil.disk_usage(directory.path).free + _size(directory.checkpoints),
    )


def refuse_what_does_not_fit(replay: ReplaySize | None, wanted: Checkpoint, capacity: Capacity) -> None:
    """Check that the replay buffer fits into memory, and that its checkpoints fit on the volume.

    Raises:
        ConfigurationError: the buffer or its checkpoints do not fit; the message has the needed size, the
            available size and the largest possible buffer.
    """
    if replay is None:
        return
    memory = replay.memory_bytes if capacity.memory_bytes is None else capacity.memory_bytes
    most = replay.most_rows(memory, capacity.disk_bytes, wanted.every_steps, wanted.keep)
    disk_bytes = replay.disk_bytes(wanted.every_steps, wanted.keep)
    what = f"algorithm.hyperparameters.buffer_size: {replay.rows:,} rows of {replay.row_bytes:,} bytes need"
    lines = []
    if replay.memory_bytes > memory:
        remedy = "raise trainer.resources.limits.memory" if capacity.memory_limit else "free some memory"
        lines.append(
            f"{what} {_gb(replay.memory_bytes)} of memory, but only {_gb(memory)} are free; "
            f"set at most {most}, or {remedy}"
        )
    if disk_bytes > capacity.disk_bytes:
        lines.append(
            f"{what} {_gb(disk_bytes)} for checkpoints, but the volume of the run directory has only "
            f"{_gb(capacity.disk_bytes)}; set at most {most}, or use a larger volume (storage.size)"
        )
    if lines:
        raise ConfigurationError("\n".join(lines))


def _available(meminfo: Path) -> int | None:
    """Return the available memory of the machine in bytes; None if the kernel does not report it."""
    for name, value in _pairs(meminfo):
        if name == "MemAvailable:":
            return value * _KIB
    return None


def _left_in_groups(groups: Path, own: Path) -> Iterator[int]:
    """Yield the memory that is left below the limit of each control group of this process.

    Memory of the file cache counts as free, because the kernel can free it.
    """
    for line in _lines(own):
        _, controllers, path = line.split(":", 2)
        if controllers == "":
            yield from _left(groups, path, ("memory.max", "memory.current", ("inactive_file", "active_file")))
        elif "memory" in controllers.split(","):
            names = ("memory.limit_in_bytes", "memory.usage_in_bytes")
            caches = ("total_inactive_file", "total_active_file")
            yield from _left(groups / "memory", path, (*names, caches))


def _left(root: Path, path: str, names: tuple[str, str, tuple[str, ...]]) -> Iterator[int]:
    limit_name, used_name, caches = names
    group = root / path.strip("/")
    for folder in (group, *group.parents):
        limit, used = _number(folder / limit_name), _number(folder / used_name)
        if limit is not None and used is not None:
            cached = sum(value for name, value in _pairs(folder / "memory.stat") if name in caches)
            yield max(limit - max(used - cached, 0), 0)
        if folder == root:
            return


def _pairs(path: Path) -> Iterator[tuple[str, int]]:
    for line in _lines(path):
        name, value, *_ = line.split()
        yield name, int(value)


def _number(path: Path) -> int | None:
    """Return the number in a file; None if the file is missing, or holds a word that means no limit."""
    lines = _lines(path)
    return int(lines[0]) if lines and lines[0].isdigit() else None


def _lines(path: Path) -> list[str]:
    try:
        return path.read_text(encoding="utf-8").splitlines()
    except OSError:
        return []


def _size(folder: Path) -> int:
    """Return the size of all files in a folder; hard links to one file count once."""
    found = (path.lstat() for path in folder.rglob("*") if path.is_file())
    return sum({entry.st_ino: entry.st_size for entry in found}.values())


def _gb(size_bytes: int) -> str:
    return f"{size_bytes / _GB:,.2f} GB"
