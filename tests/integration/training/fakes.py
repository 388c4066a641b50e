"""A trainer whose simulators are fakes in the same process: `fakes.py CONFIG RUN [DEATHS]`.

Tests run it as a real process for signals, exit codes and resumed runs. It differs from `palaestra-train`
only in its simulators. DEATHS are the numbers of steps, separated by commas, at which `collect-0` dies. With
0, `collect-0` does not start.
"""

from __future__ import annotations

import itertools
import sys
import threading
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any

import gymnasium

import palaestra_trainer.environments  # noqa: F401 - registers MoveToTargetEnv-v0
from palaestra_trainer.environments.make import make_environment
from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.job.configuration import Configuration, load
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt
from palaestra_trainer.run.telemetry.logs import configure_logs
from palaestra_trainer.testing import fake_arena, fake_seeing


class CountedResets(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment that counts its resets, because a fake reports them."""

    resets = 0

    def reset(self, **options: Any) -> Any:
        """Count the reset, and reset the environment."""
        self.resets += 1
        return super().reset(**options)


class FakeSimulator:
    """A member of a run that simulates the task without a simulator."""

    def __init__(self, name: str, configuration: Configuration, deaths: Collection[int]) -> None:
        self.name = name
        self.log: list[str] = []
        self._hangs = 0 in deaths
        self._abandoned = threading.Event()
        sees = configuration.environment.id == "SeeTarget-v0"
        self.robot, self.scene = (fake_seeing if sees else fake_arena)(deaths)
        self.env = CountedResets(make_environment(configuration.environment, self.robot, self.scene))

    @property
    def resets(self) -> int:
        """Return the number of resets since the last restart."""
        return self.env.resets

    def due(self, episodes: int = 1) -> None:
        """Return None, because a fake needs no recycling."""

    def start(self) -> None:
        """Start, or wait until `abandon` if the fake is to hang."""
        self.log.append("start")
        if self._hangs:
            sys.stderr.write("never comes up\n")
            self._abandoned.wait()
            raise SimulatorDead(self.name, "abandoned")

    def stop(self) -> None:
        """Record the call."""
        self.log.append("stop")

    def close(self) -> None:
        """Record the call."""
        self.log.append("close")

    def restart(self) -> None:
        """Restart the robot, and count resets from 0."""
        self.log.append("restart")
        self.robot.restart()
        self.env.resets = 0

    def abandon(self) -> None:
        """End a start that hangs; `start` then raises an error."""
        self._abandoned.set()

    def pause(self) -> None:
        """Record the call."""
        self.log.append("pause")

    def unpause(self) -> None:
        """Record the call."""
        self.log.append("run")


def make_members(configuration: Configuration, deaths: Collection[int] = ()) -> list[FakeSimulator]:
    """Return a fake for each simulator of a job; the first one dies at the steps `deaths`."""
    first = configuration.simulators[0].name
    return [
        FakeSimulator(entry.name, configuration, deaths if entry.name == first else ())
        for entry in configuration.simulators
    ]


def before_step(robot: Any, step: int, act: Callable[[], Any]) -> None:
    """Make a robot call `act` before a step, counted from 1; with `step=0`, never."""
    steps, advance = itertools.count(1), robot.advance
    robot.advance = lambda: (next(steps) == step and act(), advance())[1]


def main(config: str, run: str, deaths: str = "") -> int:
    """Train, and return the exit code."""
    configure_logs()
    numbers = [int(number) for number in deaths.split(",") if number]
    return attempt.run(load(Path(config)), RunDirectory(Path(run)), lambda it: make_members(it, numbers))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
