"""The simulators of a run on this machine; their addresses are in a file of the run directory."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import urlsplit

from palaestra.live_view.source import (
    EpisodeReader,
    Fetch,
    SidecarSource,
    StatusReader,
    ViewError,
    at_address,
    of_either,
)
from palaestra.plan.training import FILE, RunAddresses, SimulatorAddress


class NoRun(ViewError):
    """The folder has no run with simulators; the message has the remedy."""


class LocalRun:
    """One replica on this machine.

    Args:
        folder: the run directory of the replica, or the folder of a job with one replica.

    Raises:
        NoRun: the folder is neither a run directory nor the folder of a job with one replica.
    """

    def __init__(self, folder: Path) -> None:
        self.directory = _replica_in(folder)

    def sources(self) -> tuple[SidecarSource, ...]:
        """Return the simulators of the newest start of the run; each start has new addresses.

        Raises:
            NoRun: the file with the addresses cannot be read.
        """
        file = self.directory / FILE
        try:
            addresses = RunAddresses.read(file.read_bytes())
            trainer = _at(addresses.status)
            episodes, run = EpisodeReader(trainer), StatusReader(trainer)
            found = tuple(_source(simulator, episodes, run) for simulator in addresses.simulators)
        except (OSError, ValueError) as error:
            raise NoRun(f"{file}: names no simulators ({error}); start the run again") from error
        if not found:
            raise NoRun(f"{file}: names no simulators, so the view would be empty; start the run again")
        return found


def _source(simulator: SimulatorAddress, episodes: EpisodeReader, run: StatusReader) -> SidecarSource:
    fetch = _at(simulator.control)
    if simulator.standby:
        fetch = of_either(fetch)
    return SidecarSource(name=simulator.name, fetch=fetch, episodes=episodes, run=run, here=True)


def _at(address: str) -> Fetch:
    parts = urlsplit(f"//{address}")
    return at_address(str(parts.hostname), int(parts.port or 0))


def _replica_in(folder: Path) -> Path:
    if (folder / FILE).is_file():
        return folder
    inside = sorted(folder.glob(f"[0-9]*/{FILE}"))
    replicas = [file.parent for file in inside if file.parent.name.isdecimal()]
    if len(replicas) == 1:
        return replicas[0]
    if replicas:
        names = ", ".join(str(replica) for replica in replicas)
        raise NoRun(f"{folder}: has several replicas; name one of their folders: {names}")
    raise NoRun(f"{folder}: has no {FILE}, so it is not a run directory; give runs/JOB/REPLICA")
