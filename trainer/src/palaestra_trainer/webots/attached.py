"""A launcher for a simulator that another program starts and stops."""

from __future__ import annotations

from palaestra_trainer.errors import ConfigurationError


class Attached:
    """A launcher that starts no process; the facade uses a simulator that already runs under its name.

    The facade may step, reset, pause and change the simulator, like the program that started the simulator.
    The facade cannot stop the simulator.
    """

    def start(self) -> None:
        """Do nothing, because the simulator already runs; if it does not run, `failure` reports that."""

    def confirm_ready(self) -> None:
        """Do nothing."""

    def ready(self) -> bool:
        """Return False, so that the facade does not stop a simulator that hangs."""
        return False

    def expect_stop(self, deadline_s: float) -> None:
        """Refuse to stop the simulator.

        Raises:
            ConfigurationError: always.
        """
        del deadline_s
        raise ConfigurationError("launcher: Attached() cannot stop a simulator; stop it where it was started")

    def failure(self) -> str | None:
        """Return the reason why the simulator cannot be used; called only while it does not respond."""
        return "no simulator responds under this name; start it, or remove launcher=Attached()"

    def refused(self) -> bool:
        """Return False, because this process cannot know the exit code."""
        return False

    def wait_stopped(self, deadline_s: float) -> None:
        """Do nothing."""
        del deadline_s
