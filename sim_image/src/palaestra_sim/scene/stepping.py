"""The steps that robots request, and the time by which the world advances.

The world advances when each robot whose `synchronization` is TRUE has requested a step. Steps of different
lengths are served in parts: the world advances by the shortest remaining time. While the simulation is
paused, all steps wait.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.robot import Robot

Done = Callable[[bool], None]


class Simulated(Protocol):
    """The interface of a simulation for its steps; another simulator can implement it.

    Attributes:
        mode: the simulation mode; in PAUSE the world does not move.
        quit_status: None until a client has requested the end; after that the world does not move.
    """

    mode: Mode
    quit_status: int | None

    def advance(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`; the sensors keep their values."""
        ...

    def sample(self) -> None:
        """Set every sensor to its value at the current time."""
        ...


@dataclass(slots=True)
class _Wish:
    left_ms: int
    done: Done


class Stepping:
    """The steps that the controllers of one simulation have requested."""

    def __init__(self, simulation: Simulated) -> None:
        self._simulation = simulation
        self._awaited: set[Robot] = set()
        self._wishes: dict[Robot, _Wish] = {}

    def join(self, robot: Robot) -> None:
        """Let the world wait for this robot from now on."""
        self._awaited.add(robot)

    def leave(self, robot: Robot) -> None:
        """Stop waiting for this robot, and drop its request."""
        self._awaited.discard(robot)
        self._wishes.pop(robot, None)
        self.advance()

    def ask(self, robot: Robot, duration_ms: int, done: Done) -> None:
        """Request a step; when the world has advanced by `duration_ms`, maybe immediately, call `done(True)`.

        If the simulator ends before the world has advanced, `done(False)` is called.
        """
        self._wishes[robot] = _Wish(duration_ms, done)
        self.advance()

    def advance(self) -> None:
        """Advance the world as far as all requests allow."""
        while self._wishes and self._awaited <= self._wishes.keys() and self._may_move():
            duration_ms = min(wish.left_ms for wish in self._wishes.values())
            self._simulation.advance(duration_ms)
            self._simulation.sample()
            self._grant(duration_ms)

    def end(self) -> None:
        """Call `done(False)` for every pending step, because the simulator ends."""
        wishes, self._wishes = self._wishes, {}
        for wish in wishes.values():
            wish.done(False)

    def _may_move(self) -> bool:
        return self._simulation.mode is not Mode.PAUSE and self._simulation.quit_status is None

    def _grant(self, duration_ms: int) -> None:
        served = []
        for robot, wish in self._wishes.items():
            wish.left_ms -= duration_ms
            if wish.left_ms <= 0:
                served.append(robot)
        for robot in served:
            self._wishes.pop(robot).done(True)
