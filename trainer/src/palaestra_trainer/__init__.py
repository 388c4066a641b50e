"""The package that runs in the trainer's container and in notebooks."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from palaestra_trainer.run.policies import Policy


def load_policy(run_or_zip: str | Path) -> Policy:
    """Return the policy of a run directory, or of a model zip inside one; see `policies.load_policy`."""
    from palaestra_trainer.run import policies  # noqa: PLC0415 - PyTorch takes seconds to import

    return policies.load_policy(run_or_zip)


def report(*, step: int, success_rate: float | None = None) -> None:
    """Report the progress of your own training program to /status, /metrics and the operator.

    Call it at least once every `stallDeadlineSeconds`. After the first report, the operator ends a program
    whose step stays the same for longer. Without PALAESTRA_CONFIG (as in a notebook) it does nothing.

    Args:
        step: environment steps learned from, over all attempts; the program is complete at the job's `steps`.
        success_rate: of the last evaluation, 0 to 1; None keeps the previous value.

    Raises:
        ValueError: the step is negative, or the rate not within 0 to 1.
        ConfigurationError: the configuration cannot be read, or its statusAddress is in use.
    """
    from palaestra_trainer.run import reporting  # noqa: PLC0415 - its imports take seconds

    reporting.report(step, success_rate)
