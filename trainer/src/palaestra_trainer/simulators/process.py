"""Simulators as processes of this machine, for notebooks and scripts: no pod, no runner.

The process is a sidecar, so that restarts, kills and clean ends are the same code as in a pod.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.simulators.child import drain, end_child, first_line, start_child
from palaestra_trainer.simulators.master import ensure_master
from palaestra_trainer.simulators.sidecar import Sidecar

_END_S = 20.0
_ADDRESSES = re.compile(r"control=(\S+)")


class ProcessLauncher(Sidecar):
    """Starts a sidecar of its own, and a ROS master if none answers at ROS_MASTER_URI.

    Args:
        world: path of the world, or the name of one that ships.
        driver: stub or webots.
        options: command-line options for the simulator.
        names: the sidecar's options that give the robots ROS names of their own.

    Raises:
        ConfigurationError: the sidecar refused the world or the driver; its words are in the message.
    """

    def __init__(
        self,
        world: str | Path,
        driver: str = "stub",
        options: Sequence[str] = (),
        names: Sequence[str] = (),
    ) -> None:
        ensure_master()
        command = [
            *_program("palaestra-sidecar"),
            f"--driver={driver}",
            f"--world={world}",
            "--control=127.0.0.1:0",
            "--health=127.0.0.1:0",
            "--until-stdin-closes",
            *(f"--option={option}" for option in options),
            *names,
        ]
        self._process = start_child(command, stderr=subprocess.PIPE)
        line = first_line(self._process)
        found = _ADDRESSES.search(line)
        if found is None:
            _, said = self._process.communicate(timeout=_END_S)
            raise ConfigurationError(said.decode(errors="replace").strip() or f"the sidecar said {line!r}")
        drain(self._process)
        super().__init__(f"http://{found[1]}", Path(world).stem)

    def close(self) -> None:
        """End the sidecar, and the simulator with it."""
        end_child(self._process)


def _program(name: str) -> list[str]:
    """Return the program beside this interpreter, else wherever PATH finds it."""
    beside = Path(sys.executable).with_name(name)
    return [str(beside) if beside.exists() else name]
