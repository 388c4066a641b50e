"""A replay buffer that exceeds memory or disk is rejected before a simulator starts."""

from __future__ import annotations

import re
import shutil
from types import SimpleNamespace

import pytest

from palaestra_trainer.algorithms.replay_size import ReplaySize
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Checkpoint
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt
from palaestra_trainer.run.capacity import (
    RESERVE_BYTES,
    Capacity,
    capacity_now,
    refuse_what_does_not_fit,
)

GB = 10**9
IMAGES = ReplaySize(rows=1_000_000, row_bytes=18_452)
KEPT = Checkpoint(every_steps=5000, keep=3)


@pytest.fixture
def machine(tmp_path):
    """Return a function that writes the kernel's files; it returns the arguments for `capacity_now`."""

    def write(files, cgroup="0::/pod/container"):
        (tmp_path / "proc" / "self").mkdir(parents=True)
        (tmp_path / "proc" / "self" / "cgroup").write_text(f"5:cpu:/\n{cgroup}\n")
        (tmp_path / "proc" / "meminfo").write_text("MemTotal: 16000000 kB\nMemAvailable: 8000000 kB\n")
        for name, text in files.items():
            path = tmp_path / "groups" / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        return {"groups": tmp_path / "groups", "processes": tmp_path / "proc"}

    return write


@pytest.fixture
def begun(directory):
    """Return a run directory that exists."""
    directory.path.mkdir()
    return directory


def test_the_limit_of_a_container_counts_without_the_cache_of_files(machine, begun):
    """The kernel frees this cache first.

    After a checkpoint of some GB, the cache would look like used memory.
    """
    files = {
        "pod/container/memory.max": "2000000000",
        "pod/container/memory.current": "900000000",
        "pod/container/memory.stat": "anon 500000000\ninactive_file 300000000\nactive_file 100000000\n",
    }

    found = capacity_now(begun, **machine(files))

    assert found.memory_bytes == 1_500_000_000 - RESERVE_BYTES
    assert found.memory_limit


@pytest.mark.parametrize(
    ("cgroup", "files"),
    [
        ("0::/pod/container", {"pod/memory.max": "2000000000", "pod/memory.current": "500000000",
                               "pod/container/memory.max": "max"}),
        ("4:cpu,memory:/pod", {"memory/pod/memory.limit_in_bytes": "2000000000",
                               "memory/pod/memory.usage_in_bytes": "900000000",
                               "memory/pod/memory.stat": "total_inactive_file 400000000\n"}),
        ("0::/", {"memory.max": "2000000000", "memory.current": "500000000"}),
    ],
    ids=["of a parent", "of version 1", "in a namespace"],
)  # fmt: skip
def test_every_kind_of_limit_counts(machine, begun, cgroup, files):
    """The pod may have a limit above the container, and a node may have cgroup version 1.

    Inside a container, its own group may appear as the root.
    """
    assert capacity_now(begun, **machine(files, cgroup)).memory_bytes == 1_500_000_000 - RESERVE_BYTES


def test_without_a_limit_the_available_memory_of_the_machine_counts(machine, begun):
    """A laptop has no limit, and neither has a pod without `limits`."""
    found = capacity_now(begun, **machine({}))

    assert found.memory_bytes == 8_000_000 * 1024 - RESERVE_BYTES
    assert not found.memory_limit


def test_where_the_kernel_reports_nothing_nothing_is_refused_for_memory(tmp_path, begun):
    """Without a known limit, a buffer must not be rejected by a guess."""
    found = capacity_now(begun, groups=tmp_path / "none", processes=tmp_path / "none")

    assert found.memory_bytes is None
    refuse_what_does_not_fit(ReplaySize(rows=1, row_bytes=1), KEPT, found)


def test_checkpoints_that_are_there_are_room_for_those_to_come(begun, monkeypatch):
    """Each new checkpoint replaces an old one. A chunk that several checkpoints share counts once."""
    chunk = begun.checkpoints / "100" / "experience" / "00000.npy"
    chunk.parent.mkdir(parents=True)
    chunk.write_bytes(bytes(1 << 20))
    (begun.checkpoints / "200").mkdir()
    (begun.checkpoints / "200" / "00000.npy").hardlink_to(chunk)
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=1000))

    room = capacity_now(begun).disk_bytes

    assert room == 1000 + (1 << 20)


@pytest.mark.parametrize(
    ("memory", "limit", "disk", "lines"),
    [
        (20 * GB, True, 20 * GB, []),
        (2 * GB, True, 20 * GB, [
            ("1,000,000 rows of 18,452 bytes need 18.45 GB of memory, but only 2.00 GB are free; "
             "set at most 108389, or raise trainer.resources.limits.memory"),
        ]),
        (2 * GB, False, 20 * GB, ["set at most 108389, or free some memory"]),
        (20 * GB, True, GB, [
            ("need 18.73 GB for checkpoints, but the volume of the run directory has only 1.00 GB; "
             "set at most 39194, or use a larger volume (storage.size)"),
        ]),
        (2 * GB, True, GB, ["of memory", "for checkpoints"]),
    ],
)  # fmt: skip
def test_a_buffer_that_does_not_fit_is_refused_with_the_largest_that_does(memory, limit, disk, lines):
    """The message has both numbers, so a person can change either the job or the limit."""
    room = Capacity(memory_bytes=memory, memory_limit=limit, disk_bytes=disk)
    refused = ""

    try:
        refuse_what_does_not_fit(IMAGES, KEPT, room)
    except ConfigurationError as error:
        refused = str(error)

    assert len(refused.splitlines()) == len(lines)
    for line, part in zip(refused.splitlines(), lines, strict=True):
        assert line.startswith("algorithm.hyperparameters.buffer_size: ")
        assert part in line


def test_a_run_whose_buffer_does_not_fit_ends_with_2_before_a_simulator_starts(
    play, job, last_word, monkeypatch, tmp_path
):
    """A person copies the size from the message, so a run with this size must be accepted."""
    room = Capacity(memory_bytes=3000, memory_limit=True, disk_bytes=GB)
    monkeypatch.setattr(attempt, "capacity_now", lambda _: room)

    code, members = play(job())
    reason = last_word().reason
    most = int(re.search(r"set at most (\d+)", reason)[1])

    assert code == 2
    assert {event for member in members.values() for event in member.log} <= {"stop"}
    fitting = {"name": "DQN", "hyperparameters": {"buffer_size": most, "learning_starts": 10}}
    again, _ = play(job(algorithm=fitting), into=RunDirectory(tmp_path / "again"))
    assert again == 0
