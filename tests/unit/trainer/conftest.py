"""A corridor as environment, simulators that break at chosen steps, and runs with them."""

from __future__ import annotations

import tempfile
import threading
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium import spaces

from palaestra_protocol.pod.status import Termination
from palaestra_trainer.errors import SimulatorDead, SimulatorFault
from palaestra_trainer.job.configuration import Configuration, parse
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.run import attempt

PATIENCE_S = 20.0
GOAL = 3
MAX_STEPS = 8
TINY = {"policy_kwargs": {"net_arch": [8]}}
ALGORITHMS = {
    "DQN": TINY | {"learning_starts": 10, "batch_size": 8, "buffer_size": 500},
    "PPO": TINY | {"n_steps": 16, "batch_size": 8, "n_epochs": 2},
    "A2C": TINY,
    "REINFORCE": TINY | {"episodes_per_update": 2},
}


@pytest.fixture(autouse=True)
def scratch(monkeypatch, tmp_path):
    """Keep Stable-Baselines3's folders in the test's folder; without a logger it makes one per `learn`."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


class Clock:
    """A clock that a test sets."""

    now = 0.0

    def __call__(self) -> float:
        """Return the time."""
        return self.now


@pytest.fixture
def clock() -> Clock:
    """Return a clock that does not move by itself."""
    return Clock()


class Corridor(gymnasium.Env[np.ndarray, Any]):
    """A corridor: right (1) leads to the goal, three steps away; left (0) leads nowhere, for eight steps.

    The observation is the position and the seed's last digit, both divided by 10. `report` returns the info's
    entry about success, from the seed and whether the goal was reached; a test may replace it.
    """

    observation_space = spaces.Box(-1.0, 1.0, (2,), np.float32)
    action_space = spaces.Discrete(2)
    step_reward = -0.1

    def __init__(self, member: FakeMember) -> None:
        self._member = member
        self.seeds: list[int | None] = []
        self.options: dict[str, Any] | None = None
        self.report: Callable[[int | None, bool], dict[str, Any]] = lambda _seed, reached: {
            "is_success": reached
        }

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None):
        """Begin an episode, or break."""
        super().reset(seed=seed)
        self._member.take_reset()
        self.seeds.append(seed)
        self.options = options
        self._position, self._steps = 0, 0
        self._digit = (seed or 0) % 10
        return self._observe(), {"seed": seed}

    def step(self, action: Any):
        """Take a step in the corridor, or break."""
        self._member.take_step()
        self._steps += 1
        self._position += 1 if np.asarray(action).item() > 0.5 else -1
        reached = self._position >= GOAL
        reward = 1.0 if reached else self.step_reward
        return (
            self._observe(),
            reward,
            reached,
            self._steps >= MAX_STEPS and not reached,
            {**self.report(self.seeds[-1], reached), "reward_terms": {"walk": reward}},
        )

    def _observe(self) -> np.ndarray:
        return np.array([self._position / 10, self._digit / 10], np.float32)


class FakeMember:
    """A simulator that breaks at chosen steps, resets and starts, each counted from 1 over its whole life.

    A reload is a start. After `recycle_after` resets the simulator is due to be recycled. With `reloads`, it
    loads its world before each episode but the first. With `held`, a restart waits until `release` is
    set, and fails if the simulator is abandoned.
    """

    def __init__(
        self,
        name: str = "collect-0",
        *,
        steps: Mapping[int, SimulatorFault] | Sequence[int] = (),
        resets: Mapping[int, SimulatorFault] | Sequence[int] = (),
        starts: Mapping[int, SimulatorFault] | Sequence[int] = (),
        recycle_after: int | None = None,
        held: bool = False,
    ) -> None:
        self.name = name
        self.env: gymnasium.Env[Any, Any] = Corridor(self)
        self.log: list[str] = []
        self.resets = 0
        self._recycle_after = recycle_after
        self.reloads = False
        self.release = threading.Event()
        self._abandoned = False
        if not held:
            self.release.set()
        self._faults = {"step": steps, "reset": resets, "start": starts}
        self._counts = dict.fromkeys(self._faults, 0)

    def due(self, episodes: int = 1) -> str | None:
        """Return the reason to recycle the simulator, or None."""
        worn = self._recycle_after is not None and self.resets + episodes > self._recycle_after
        return f"{self.resets} resets" if worn else None

    def reload_due(self) -> bool:
        """Return whether the world must be loaded again."""
        return self.reloads and self.resets > 0

    def reload(self) -> None:
        """Load the world again, or break."""
        self.log.append("reload")
        self._take("start")

    def start(self) -> None:
        """Start, or break."""
        self.log.append("start")
        self._take("start")
        self.resets = 0

    def stop(self) -> None:
        """Record the call."""
        self.log.append("stop")

    def restart(self) -> None:
        """Start again, or break."""
        self.log.append("restart")
        assert self.release.wait(PATIENCE_S)
        if self._abandoned:
            raise SimulatorDead(self.name, "was abandoned")
        self._take("start")
        self.resets = 0

    def abandon(self) -> None:
        """Let a held restart fail."""
        self._abandoned = True
        self.release.set()

    def pause(self) -> None:
        """Record the call."""
        self.log.append("pause")

    def unpause(self) -> None:
        """Record the call."""
        self.log.append("run")

    def take_step(self) -> None:
        """Count a step, and break if a fault is set for it."""
        self._take("step")

    def take_reset(self) -> None:
        """Count a reset, and break if a fault is set for it."""
        self._take("reset")
        self.resets += 1

    def _take(self, what: str) -> None:
        self._counts[what] += 1
        faults = self._faults[what]
        if self._counts[what] in faults:
            raise (
                faults[self._counts[what]]
                if isinstance(faults, Mapping)
                else SimulatorDead(self.name, f"died at {what} {self._counts[what]}")
            )


@pytest.fixture
def make_member() -> Callable[..., FakeMember]:
    """Return a function that makes a simulator of the corridor."""
    return FakeMember


@pytest.fixture
def make_configuration(tmp_path: Path) -> Callable[..., Configuration]:
    """Return a function that makes a configuration; its keywords are fields of the file."""
    del tmp_path

    def make(*, collectors: int = 1, evaluators: int = 1, **changes: Any) -> Configuration:
        simulators = [
            {"name": f"{group}-{index}", "group": group, "index": index, "role": role}
            for group, role, count in (
                ("collect", "Collect", collectors),
                ("evaluate", "Evaluate", evaluators),
            )
            for index in range(count)
        ]
        content: dict[str, Any] = {
            "job": "corridor",
            "seed": 1,
            "environment": {"id": "Corridor-v0"},
            "algorithm": {"name": "DQN"},
            "steps": 100,
            "statusAddress": "127.0.0.1:0",
            "simulators": simulators,
        }
        return parse(content | changes)

    return make


@pytest.fixture
def directory(tmp_path):
    """Return a run directory."""
    return RunDirectory(tmp_path / "run")


@pytest.fixture
def last_word(tmp_path, monkeypatch):
    """Return a function that reads and decodes the termination message."""
    path = tmp_path / "word"
    monkeypatch.setenv("PALAESTRA_TERMINATION_LOG", str(path))
    return lambda: Termination.from_message(path.read_text())


@pytest.fixture
def job(make_configuration):
    """Return a function that makes the configuration of a short run of an algorithm."""

    def make(name="DQN", **changes):
        defaults = {
            "algorithm": {"name": name, "hyperparameters": ALGORITHMS[name]},
            "evaluation": {"everySteps": 40, "episodes": 4, "confirmEpisodes": 4},
            "checkpoint": {"everySteps": 50, "keep": 2},
        }
        return make_configuration(**(defaults | changes))

    return make


@pytest.fixture
def play(directory, make_member):
    """Return a function that trains; it returns the exit code and the simulators by name.

    `faults` has the faults by a simulator's name. `on_step` is called after each step of the simulator `of`.
    The environments report success by `report`. The run is written to the run directory `into`.
    """

    def run(  # noqa: PLR0913 - what a test changes of a run
        configuration,
        faults=(),
        on_step=None,
        *,
        step_reward=-0.1,
        of="collect-0",
        into=directory,
        report=None,
        **options,
    ):
        members = {}

        def make_members(given):
            for entry in given.simulators:
                members[entry.name] = make_member(entry.name, **dict(faults).get(entry.name, {}))
                members[entry.name].env.step_reward = step_reward
                if report:
                    members[entry.name].env.report = report
            if on_step:
                member = members[of]
                member.take_step = lambda take=member.take_step: (take(), on_step())
            return list(members.values())

        return attempt.run(configuration, into, make_members, **options), members

    return run
