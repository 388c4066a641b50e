"""The time of a step by part: the simulator, the transport and the environment."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

from palaestra_trainer.waiting.wait_time import waited_s


@dataclass(slots=True, kw_only=True)
class StepTimes:
    """Seconds of all steps together.

    Attributes:
        count: number of steps.
        simulator_s: waiting for the simulator.
        transport_s: sending commands, and reading and checking sensors.
        environment_s: the environment's own code, its wrappers, and the checks of what it returns.
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
        """Count the time of one step; one that raises is not counted.

        Args:
            transported: returns the seconds of transport so far.
            clock: returns seconds.
            waited: returns the seconds that this thread has waited for simulators so far.
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
        """Seconds of all steps."""
        return self.simulator_s + self.transport_s + self.environment_s
