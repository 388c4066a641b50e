"""Let a run's progress show what members report of themselves."""

from __future__ import annotations

from collections.abc import Iterable

from palaestra_trainer.simulators.interface import Member, ReportsLeftOut, Spared
from palaestra_trainer.telemetry.progress import Progress


def follow(progress: Progress, members: Iterable[Member]) -> None:
    """Show the spares of members, and what their simulators leave out of their worlds."""
    for member in members:
        if isinstance(member, Spared):
            progress.has_standby(member.name, member.spare)
        if isinstance(member, ReportsLeftOut):
            progress.reports_left_out(member.name, member.left_out)
