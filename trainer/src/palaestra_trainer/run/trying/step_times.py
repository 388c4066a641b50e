"""Measure the time of a step in three parts: the simulator, the transport and the environment."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from palaestra_trainer.waiting.wait_time import waited_s


@dataclass(slots=True, kw_only=True)
class StepTimes:
    """The total time of all steps, in seconds.

    Attributes:
        count: number of steps.
        simulator_s: time of waiting for the simulator.
        transport_s: time of sending commands, and of reading and checking sensors.
        environment_s: time of the environment's own code, of its wrappers, and of the checks of its results.
    """

    count: int = 0
    simulator_s: float = 0.0
    transport_s: float = 0.0
    environment_s: float = 0.0

    @contextmanager
    def step(
        self,
        transported: Callable[[], float],
        clock: Callable[[], float] = time.perf_counter,
        waited: Callable[[], float] = waited_s,
    ) -> Iterator[None]:
        """Add the time of one step; a step that raises is not counted.

        Args:
            transported: a function that returns the seconds of transport so far.
            clock: a function that returns the time in seconds.
            waited: a function that returns the seconds that this thread has waited for simulators.
        """
        began, waits, transports = clock(), waited(), transported()
        yield
        seconds, waits, transports = clock() - began, waited() - waits, transported() - transports
        self.count += 1
        self.simulator_s += waits
        self.transport_s += transports
        self.environment_s += max(seconds - waits - transports, 0.0)

    @property
    def seconds(self) -> float:
        """The total seconds of all steps."""
        return self.simulator_s + self.transport_s + self.environment_s
