"""Apply faults to the process: send a signal, allocate memory, exit. Other modules choose the time."""

from __future__ import annotations

import logging
import resource
import signal
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Protocol

from palaestra_sim.faults.kinds import (
    Crash,
    Exit,
    Hang,
    InjectedFault,
    MasterLostFault,
    MemoryGrowth,
    NamesLost,
)

_MIB = 1024 * 1024

log = logging.getLogger(__name__)


class Endings(Protocol):
    """The methods of the program that end the process, or that affect all ROS nodes of the process."""

    def end(self, status: int) -> None:
        """Close all connections and exit with the code `status`."""
        ...

    def lose_master(self) -> None:
        """Exit as if the ROS master no longer responded."""
        ...

    def lose_names(self) -> None:
        """Unregister every name at the master, and continue."""
        ...


class ProcessFaults:
    """Applies faults to this process.

    Args:
        endings: the methods that end this process, or unregister its names.
    """

    def __init__(self, endings: Endings) -> None:
        self._endings = endings
        self._kept: list[bytes] = []
        self._kept_mib = 0.0
        self._effects: Mapping[type[InjectedFault], Callable[[Any], bool]] = {
            Crash: self._crash,
            Exit: self._exit,
            Hang: self._hang,
            MasterLostFault: self._lose_master,
            MemoryGrowth: self._grow,
            NamesLost: self._lose_names,
        }

    def happen(self, faults: Sequence[InjectedFault]) -> bool:
        """Apply the faults in their order; return whether the stub continues."""
        for fault in faults:
            if not isinstance(fault, MemoryGrowth):
                log.warning("fault: %s", fault.text)
            if not self._effects[type(fault)](fault):
                return False
        return True

    def _crash(self, fault: Crash) -> bool:
        # Write no core file: the crash is intended, and the file would only take up space.
        resource.setrlimit(resource.RLIMIT_CORE, (0, resource.getrlimit(resource.RLIMIT_CORE)[1]))
        if fault.signal is not signal.SIGKILL:
            signal.signal(fault.signal, signal.SIG_DFL)
        signal.raise_signal(fault.signal)  # ends the process before it can send another response
        return False

    def _exit(self, fault: Exit) -> bool:
        self._endings.end(fault.code)
        return False

    def _hang(self, _fault: Hang) -> bool:
        signal.raise_signal(signal.SIGSTOP)
        return True  # reached after a SIGCONT

    def _lose_master(self, _fault: MasterLostFault) -> bool:
        self._endings.lose_master()
        return False

    def _lose_names(self, _fault: NamesLost) -> bool:
        self._endings.lose_names()
        return True

    def _grow(self, fault: MemoryGrowth) -> bool:
        if self._kept_mib + fault.mib <= fault.most_mib:
            self._kept_mib += fault.mib
            # The bytes are not zeros, because the kernel could keep pages of zeros without using memory.
            self._kept.append(b"\1" * int(fault.mib * _MIB))
        return True
