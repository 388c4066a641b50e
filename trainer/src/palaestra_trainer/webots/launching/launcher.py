"""The interface between the facade `Webots` and the objects that start simulators."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol

from palaestra_trainer.webots.launching.owned_sidecar import OwnedSidecar
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest


class Launcher(Protocol):
    """Starts a simulator and reports whether it runs."""

    def start(self) -> None:
        """Start the simulator without waiting until it is ready."""
        ...

    def confirm_ready(self) -> None:
        """Report that the simulator has responded to a real request."""
        ...

    def ready(self) -> bool:
        """Return whether the simulator runs and was confirmed as ready."""
        ...

    def expect_stop(self, deadline_s: float) -> None:
        """Announce that the simulator will end; after `deadline_s` seconds, kill it."""
        ...

    def failure(self) -> str | None:
        """Return the reason why the simulator no longer runs; None while it runs or starts."""
        ...

    def refused(self) -> bool:
        """Return whether the simulator ended with exit code 2, with which a program refuses its input."""
        ...

    def wait_stopped(self, deadline_s: float) -> None:
        """Wait until the simulator has ended.

        Raises:
            SimulatorHung: the simulator did not end within `deadline_s` seconds.
        """
        ...


class Place(ABC):
    """A place in which simulators start: this machine, a Docker Engine or a Kubernetes cluster."""

    @abstractmethod
    def launch(self, request: SimulatorRequest) -> OwnedSidecar:
        """Start a sidecar, which waits for the order to start its simulator.

        Raises:
            ConfigurationError: the place cannot start the sidecar, or the sidecar refused its input.
        """
