"""Run simulators as processes of this machine, for notebooks and scripts outside of a pod.

The trainer starts a sidecar, which starts the simulator. So restarts, kills and clean ends use the same code
as in a pod.
"""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.launching.master import ensure_master
from palaestra_trainer.webots.launching.ros_name_locks import Reservation
from palaestra_trainer.webots.launching.sidecar import Sidecar
from palaestra_trainer.webots.launching.subprocesses import drain, end_child, first_line, start_child

_END_S = 20.0
_MOST_BESIDE = 100
_ADDRESSES = re.compile(r"control=(\S+)")


class ProcessLauncher(Sidecar):
    """Starts a new sidecar; if no ROS master responds at ROS_MASTER_URI, also starts a master.

    Args:
        world: path of the world, or the name of a world that Palaestra ships.
        driver: the simulator program, `stub`, `mujoco` or `webots`.
        options: command-line options for the simulator.
        names: sidecar options that set the ROS names of the robots.
        suffix: text that is appended to the ROS names in the world.

    Raises:
        ConfigurationError: the sidecar refused the world or the driver; the message has its output.
    """

    def __init__(
        self,
        world: str | Path,
        driver: str = "stub",
        options: Sequence[str] = (),
        names: Sequence[str] = (),
        suffix: str = "",
    ) -> None:
        ensure_master()
        self.suffix = suffix
        self._reservation = Reservation()
        command = [
            *_program("palaestra-sidecar"),
            f"--driver={driver}",
            f"--world={world}",
            f"--suffix={suffix}",
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
            raise ConfigurationError(said.decode(errors="replace").strip() or f"the sidecar printed {line!r}")
        drain(self._process)
        super().__init__(f"http://{found[1]}", Path(world).stem)

    @classmethod
    def beside_others(cls, world: str | Path, driver: str, options: Sequence[str]) -> ProcessLauncher:
        """Return a launcher with the world's ROS names, or with `_2`, `_3`, ... appended if they are in use.

        Raises:
            ConfigurationError: the sidecar refused the world or the driver, or all names are in use.
        """
        for number in range(1, _MOST_BESIDE + 1):
            launcher = cls(world, driver, options, suffix="" if number == 1 else f"_{number}")
            with ExitStack() as undo:
                undo.callback(launcher.close)
                if launcher.reserve():
                    undo.pop_all()
                    return launcher
        raise ConfigurationError(
            f"{world}: {_MOST_BESIDE} simulators with its ROS names are already running; close unused ones"
        )

    def reserve(self) -> bool:
        """Reserve the ROS names of this simulator until `close`; return False if a name is in use.

        Raises:
            MasterLost: no ROS master responds.
        """
        return self._reservation.take(robot.ros_name for robot in self.state().robots)

    def close(self) -> None:
        """End the sidecar and its simulator."""
        end_child(self._process)
        self._reservation.release()


def _program(name: str) -> list[str]:
    """Return the command of a program: its path next to this interpreter, or else its name."""
    installed = Path(sys.executable).with_name(name)
    return [str(installed) if installed.exists() else name]
