"""`python -m tools.worlds DIR...`: count the Webots worlds in folders that each simulator starts.

The folders are checkouts of projects. The program sets the controllers of each world's robots to `ros`, in a
copy. The copy is next to the world, because worlds refer to files by relative paths. Equal worlds count once.
If a world starts only with `--leave-out all`, the program prints it with the messages that refuse it.
"""

from __future__ import annotations

import argparse
import os
import re
import subprocess
import sys
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Final

SIMULATORS: Final = ("palaestra-stub", "palaestra-mujoco")
DEADLINE_S: Final = 180.0
# Matches a robot's controller, except `<none>` and `void`: robots with these two values have no controller.
CONTROLLER: Final = re.compile(rb'(\bcontroller\s+)"(?!<none>|void")[^"\n]*"')
VOID: Final = re.compile(rb'(\bcontroller\s+)"void"')
UNCONTROLLED: Final = re.compile(r'controller "(?:<none>|void)"')
MARK: Final = ".counted.wbt"
HEADER: Final = b"#VRML_SIM "  # files with another header are parts of worlds
LINE: Final = 80
MOTORS: Final = ("RotationalMotor", "LinearMotor")
# Types of devices that are neither motors nor sensors.
OTHERS: Final = ("Brake", "Display", "Emitter", "LED", "Pen", "Skin", "Speaker")


@dataclass(frozen=True, slots=True, kw_only=True)
class Answer:
    """The result of one simulator for one world.

    Attributes:
        starts: whether the world starts without `--leave-out`.
        with_left_out: whether it starts with `--leave-out all`.
        keeps: whether, with `--leave-out all`, a robot has a motor and a sensor.
        refusals: the messages that refuse the world without `--leave-out`.
    """

    starts: bool
    with_left_out: bool
    keeps: bool
    refusals: tuple[str, ...] = field(default=())


def main(arguments: Sequence[str] | None = None) -> int:
    """Print the refusals and the counts; return 0 if every world starts with `--leave-out all`."""
    about = (__doc__ or "").splitlines()[0]
    parser = argparse.ArgumentParser(prog="python -m tools.worlds", description=about)
    parser.add_argument("folders", metavar="DIR", nargs="+", type=Path)
    parser.add_argument("--simulator", choices=SIMULATORS, action="append")
    given = parser.parse_args(arguments)
    worlds = list(distinct(given.folders))
    complete = True
    for simulator in given.simulator or SIMULATORS:
        with ThreadPoolExecutor(os.cpu_count()) as pool:
            answers = list(pool.map(partial(asked, simulator), worlds))
        report(simulator, worlds, answers, sys.stdout.write)
        complete &= all(it.with_left_out for it in answers)
    return 0 if complete else 1


def distinct(folders: Sequence[Path]) -> Iterator[Path]:
    """Yield the worlds below the folders; if several worlds are equal, yield only the first of them."""
    seen: set[bytes] = set()
    for file in sorted(file for folder in folders for file in folder.rglob("*.wbt")):
        content = file.read_bytes()
        if not file.name.endswith(MARK) and HEADER in content[:LINE] and content not in seen:
            seen.add(content)
            yield file


def asked(simulator: str, world: Path) -> Answer:
    """Return the result of a simulator's `--check` for a world whose robots have the controller `ros`."""
    with for_ros(world, simulator) as copy:
        check = partial(run, Path(sys.executable).with_name(simulator), "--check", copy)
        as_it_is, with_left_out = check(), check("--leave-out", "all")
    text = as_it_is.stdout + as_it_is.stderr
    return Answer(
        starts=not as_it_is.returncode,
        with_left_out=not with_left_out.returncode,
        keeps=any(map(is_complete, with_left_out.stdout.splitlines())),
        refusals=tuple(line for line in text.splitlines() if line.startswith(copy.name)),
    )


@contextmanager
def for_ros(world: Path, simulator: str) -> Iterator[Path]:
    """Write a copy next to a world, in which robots have the controller `ros`; yield the path of the copy.

    A robot with the controller `void` gets the controller `ros` only if no other robot has a controller: such
    a world waits for the controller of its user.
    """
    copy = world.with_name(f"{world.stem}.{simulator}{MARK}")
    content, driven = CONTROLLER.subn(rb'\1"ros"', world.read_bytes())
    copy.write_bytes(content if driven else VOID.sub(rb'\1"ros"', content))
    try:
        yield copy
    finally:
        copy.unlink()


def is_complete(line: str) -> bool:
    """Return whether a line of `--check` describes a robot that has a controller, a motor and a sensor.

    `for_ros` does not replace a controller that a PROTO names, but users can, in their world.
    """
    if not line.startswith('robot "') or UNCONTROLLED.search(line):
        return False
    types = set(re.findall(r"\b\d+ ([A-Z]\w+)", line))
    return bool(types.intersection(MOTORS) and types.difference(MOTORS, OTHERS))


def report(
    simulator: str, worlds: Sequence[Path], answers: Sequence[Answer], write: Callable[[str], object]
) -> None:
    """Write the refused worlds, the number of worlds for each refusal, and the totals."""
    kinds: Counter[str] = Counter()
    for world, answer in zip(worlds, answers, strict=True):
        facts = {re.sub(r"^\S+:\d+:\d+: ", "", line) for line in answer.refusals}
        if not answer.starts:
            kinds.update(facts or {"another reason"})
            write(f"{simulator}: {world}: {'; '.join(sorted(facts))}\n")
        if not answer.with_left_out:
            write(f"{simulator}: {world}: refused with --leave-out all\n")
    for fact, count in kinds.most_common():
        write(f"{simulator}: {count:4} {fact}\n")
    write(
        f"{simulator}: {sum(it.starts for it in answers)} of {len(answers)} worlds start as they are, "
        f"{sum(it.with_left_out for it in answers)} with --leave-out all; "
        f"{sum(it.keeps for it in answers)} of these keep a robot with a motor and a sensor\n"
    )


def run(*command: str | Path) -> subprocess.CompletedProcess[str]:
    """Run a program to its end."""
    return subprocess.run(command, capture_output=True, text=True, timeout=DEADLINE_S, check=False)


if __name__ == "__main__":
    sys.exit(main())
