"""Measure the time of the tests by program, folder, file and fixture.

`python -m tests.costs COMMAND…` runs a command and prints the processor seconds of each program that ran
meanwhile. If the command is pytest with `-p tests.costs`, it also prints the seconds of each folder, file,
fixture and test. The program samples the table of processes, so it misses a process that ends within one
sampling period. The row `not sampled` is the difference between the kernel's count and the sum of the
samples.
"""

import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
from collections import defaultdict
from collections.abc import Generator, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

FOLDER = "PALAESTRA_COSTS"  # names the folder in which each pytest process writes a file
PERIOD_S = 0.25
ROWS = 60
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
OPTION = re.compile(r"^-")
Record = dict[str, Any]


# The plugin measures the tests in each pytest process.


class Spent:
    """Wall and processor seconds by name; processor seconds include child processes that have ended."""

    def __init__(self) -> None:
        self.rows: defaultdict[str, list[float]] = defaultdict(lambda: [0.0, 0.0, 0.0])

    @contextmanager
    def on(self, name: str) -> Iterator[None]:
        """Add the time of the block to a name."""
        before = _clocks()
        yield
        row = self.rows[name]
        for index, (was, now) in enumerate(zip(before, _clocks(), strict=True)):
            row[index] += now - was


folders, files, fixtures, tests = Spent(), Spent(), Spent(), Spent()


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None]:
    """Measure the collection of tests."""
    with folders.on("(collection)"):
        return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None]:
    """Measure a test with its setup and cleanup."""
    file = Path(item.location[0])
    with folders.on(file.parent.as_posix()), files.on(file.as_posix()), tests.on(item.nodeid):
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_fixture_setup(fixturedef: pytest.FixtureDef[Any]) -> Generator[None]:
    """Measure the setup of a fixture, without the fixtures that it requests."""
    with fixtures.on(f"{fixturedef.baseid}::{fixturedef.argname}"):
        return (yield)


def pytest_sessionfinish() -> None:
    """Write the measurements to a file for the program that started pytest."""
    if folder := os.environ.get(FOLDER):
        kinds = {"folder": folders, "file": files, "fixture": fixtures, "test": tests}
        content = {kind: spent.rows for kind, spent in kinds.items()}
        (Path(folder) / f"{os.getpid()}.json").write_text(json.dumps(content))


def _clocks() -> tuple[float, float, float]:
    times = os.times()
    return (
        time.monotonic(),
        times.user + times.system,
        times.children_user + times.children_system,
    )


# The program that runs the command measures the whole machine.


class Sampler:
    """The processor time of each program that runs between `start` and `stop`."""

    def __init__(self) -> None:
        self._seen: dict[tuple[int, int], tuple[str, int]] = {}
        self._before: dict[tuple[int, int], int] = {}
        self._over = threading.Event()
        self._thread = threading.Thread(target=self._watch)
        self._busy = 0.0

    def start(self) -> None:
        """Start sampling; processor time that processes used earlier is not counted."""
        self._before = {key: ticks for key, _, ticks in _processes()}
        self._busy = _busy_s()
        self._thread.start()

    def stop(self) -> tuple[dict[str, list[float]], float]:
        """Return the seconds and processes of each program, and the seconds of the whole machine."""
        self._over.set()
        self._thread.join()
        used: defaultdict[str, list[float]] = defaultdict(lambda: [0.0, 0.0])
        for key, (program, ticks) in self._seen.items():
            used[program][0] += (ticks - self._before.get(key, 0)) / TICKS_PER_S
            used[program][1] += key not in self._before
        return used, _busy_s() - self._busy

    def _watch(self) -> None:
        while not self._over.wait(PERIOD_S):
            for key, program, ticks in _processes():
                self._seen[key] = (program, ticks)


def _processes() -> Iterator[tuple[tuple[int, int], str, int]]:
    """Yield pid and start time, program and used ticks of every process with a command line."""
    for entry in os.scandir("/proc"):
        if not entry.name.isdecimal():
            continue
        try:
            stat = Path(entry.path, "stat").read_text().rpartition(")")[2].split()
            command = Path(entry.path, "cmdline").read_bytes().decode(errors="replace").split("\0")
        except OSError:
            continue
        if command != [""]:
            yield (int(entry.name), int(stat[19])), _program(command), int(stat[11]) + int(stat[12])


def _program(command: list[str]) -> str:
    """Return a program's name; for Python, return the name of its script or module."""
    name, *arguments = command
    base = Path(name).name
    if not base.startswith("python"):
        return base
    if "-m" in arguments[:3]:
        return " ".join(arguments[arguments.index("-m") : arguments.index("-m") + 2])
    if "-c" in arguments[:3]:
        code = arguments[arguments.index("-c") + 1]
        return "pytest worker" if "execnet" in code else "python -c"
    scripts = [each for each in arguments if each and not OPTION.match(each)]
    return Path(scripts[0]).name if scripts else base


def _busy_s() -> float:
    """Return the processor seconds that the machine has used since it started."""
    first = Path("/proc/stat").read_text().partition("\n")[0]
    user, nice, system, _, _, irq, soft, *_ = map(int, first.split()[1:])
    return (user + nice + system + irq + soft) / TICKS_PER_S


def main(command: list[str]) -> int:
    """Run the command, print the tables to standard error, and return its exit code."""
    with tempfile.TemporaryDirectory(prefix="costs-") as folder:
        sampler, began = Sampler(), time.monotonic()
        sampler.start()
        done = subprocess.run(command, env=os.environ | {FOLDER: folder}, check=False)
        programs, busy_s = sampler.stop()
        wall_s = time.monotonic() - began
        records = [json.loads(path.read_text()) for path in Path(folder).glob("*.json")]
    sampled_s = sum(used for used, _ in programs.values())
    _print("program", [*programs.items(), ("not sampled", [busy_s - sampled_s, 0])], ("cpu", "processes"))
    for kind in ("folder", "file", "fixture", "test"):
        _print(kind, list(_added(records, kind).items()), ("wall", "own cpu", "children's cpu"))
    sys.stderr.write(f"\nwall {wall_s:.0f} s, processor {busy_s:.0f} s\n")
    return done.returncode


def _added(records: list[Record], kind: str) -> dict[str, list[float]]:
    total: dict[str, list[float]] = {}
    for record in records:
        for name, row in record[kind].items():
            total[name] = [a + b for a, b in zip(total.get(name, [0.0] * 3), row, strict=True)]
    return total


def _print(title: str, rows: list[tuple[str, list[float]]], columns: tuple[str, ...]) -> None:
    sys.stderr.write(f"\n{' '.join(f'{each:>15}' for each in columns)}  {title}\n")
    for name, values in sorted(rows, key=lambda row: -row[1][0])[:ROWS]:
        sys.stderr.write(f"{' '.join(f'{each:>15.1f}' for each in values)}  {name}\n")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
