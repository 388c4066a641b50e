"""A simulator that another program starts and ends."""

from __future__ import annotations

from palaestra_trainer.errors import ConfigurationError


class Attached:
    """A launcher that starts nothing: the facade uses the simulator that already runs under its name.

    The facade may step, reset, pause and change it, like the program that started it. It cannot stop it.
    """

    def start(self) -> None:
        """Start nothing: it runs already, or `failure` reports that it does not."""

    def confirm_ready(self) -> None:
        """Do nothing."""

    def ready(self) -> bool:
        """Return False: this facade does not stop a simulator that hangs."""
        return False

    def expect_stop(self, deadline_s: float) -> None:
        """Refuse to stop it.

        Raises:
            ConfigurationError: always.
        """
        del deadline_s
        raise ConfigurationError("only attached to this simulator; stop it where it was started")

    def failure(self) -> str | None:
        """Return why it cannot be used; called only while it does not answer."""
        return "no simulator answers under this name; start it, or remove launcher=Attached()"

    def refused(self) -> bool:
        """Return False: nobody here knows its exit code."""
        return False

    def wait_stopped(self, deadline_s: float) -> None:
        """Do nothing."""
        del deadline_s
