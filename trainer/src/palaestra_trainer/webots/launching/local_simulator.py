"""Run simulators as processes of this machine, for notebooks and scripts outside of a pod.

The trainer starts a sidecar, which starts the simulator. So restarts, kills and clean ends use the same code
as in a pod.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.webots.launching.launcher import Place
from palaestra_trainer.webots.launching.master import ensure_master
from palaestra_trainer.webots.launching.owned_sidecar import OwnedSidecar
from palaestra_trainer.webots.launching.sidecar_command import SIDECAR, control_address, sidecar_options
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest
from palaestra_trainer.webots.launching.subprocesses import drain, end_child, first_line, start_child

_END_S = 20.0


class ProcessLauncher(OwnedSidecar):
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
        request = SimulatorRequest(world=world, driver=driver, options=options, suffix=suffix)
        listeners = ("--control=127.0.0.1:0", "--health=127.0.0.1:0", "--until-stdin-closes")
        self._process = start_child(
            [*_program(SIDECAR), *sidecar_options(request), *listeners, *names], stderr=subprocess.PIPE
        )
        line = first_line(self._process)
        address = control_address(line)
        if address is None:
            _, said = self._process.communicate(timeout=_END_S)
            raise ConfigurationError(said.decode(errors="replace").strip() or f"the sidecar printed {line!r}")
        drain(self._process)
        super().__init__(f"http://{address}", Path(world).stem, suffix)

    def _end(self) -> None:
        end_child(self._process)


class ThisMachine(Place):
    """Starts simulators as processes of this machine."""

    def launch(self, request: SimulatorRequest) -> ProcessLauncher:
        """Start a sidecar; see `Place`."""
        return ProcessLauncher(request.world, request.driver, request.options, suffix=request.suffix)


def _program(name: str) -> list[str]:
    """Return the command of a program: its path next to this interpreter, or else its name."""
    installed = Path(sys.executable).with_name(name)
    return [str(installed) if installed.exists() else name]
