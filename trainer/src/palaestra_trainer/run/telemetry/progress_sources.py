"""Connect the reports of members to the progress of a run."""

from __future__ import annotations

from collections.abc import Iterable

from palaestra_trainer.run.telemetry.progress import Progress
from palaestra_trainer.simulators.interface import Member, ReportsLeftOut, Spared


def follow(progress: Progress, members: Iterable[Member]) -> None:
    """Let `progress` report the state of members' standbys, and the parts that simulators left out."""
    for member in members:
        if isinstance(member, Spared):
            progress.has_standby(member.name, member.spare)
        if isinstance(member, ReportsLeftOut):
            progress.reports_left_out(member.name, member.left_out)
