"""A simulator that another program started and will end."""

from __future__ import annotations

from palaestra_trainer.errors import ConfigurationError


class Attached:
    """A launcher that launches nothing: the facade uses the simulator that runs under its name.

    The facade may step, reset, pause and change it, like the program that started it. It cannot stop it.
    """

    def start(self) -> None:
        """Start nothing: it runs, or `failure` says that it does not."""

    def confirm_ready(self) -> None:
        """Note nothing."""

    def ready(self) -> bool:
        """Return False: what hangs is not stopped from here."""
        return False

    def expect_stop(self, deadline_s: float) -> None:
        """Refuse to stop it.

        Raises:
            ConfigurationError: always.
        """
        del deadline_s
        raise ConfigurationError("this simulator is only attached to; stop it where it was started")

    def failure(self) -> str | None:
        """Return why it cannot be used; asked only while it does not answer."""
        return "no simulator answers under this name; start it, or leave out launcher=Attached()"

    def wait_stopped(self, deadline_s: float) -> None:
        """Wait for nothing."""
        del deadline_s
