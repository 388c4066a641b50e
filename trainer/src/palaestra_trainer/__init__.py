"""What runs in the trainer's container, and in a notebook."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from palaestra_trainer.policies import Policy


def load_policy(run_or_zip: str | Path) -> Policy:
    """Return the policy of a run directory, or of a zip of a model in one, see `policies.load_policy`."""
    from palaestra_trainer import policies  # noqa: PLC0415 - PyTorch takes seconds to import

    return policies.load_policy(run_or_zip)
