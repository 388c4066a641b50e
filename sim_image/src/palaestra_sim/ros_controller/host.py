"""The interface through which the services of a robot use the running simulator.

The module of the simulator imports the services, because the simulator starts and ends the controllers. To
avoid an import cycle, the services import only this Protocol.
"""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from palaestra_sim.scene.arguments import ControllerArguments
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.robot import Robot


class Host(Protocol):
    """A running simulator; it may load several worlds one after another.

    Attributes:
        world_path: the path of the loaded world.
    """

    world_path: Path

    def arguments(self, robot: Robot) -> ControllerArguments:
        """Return the controllerArgs of a robot whose controller is "ros"."""
        ...

    def set_mode(self, mode: Mode) -> None:
        """Set the simulation mode; pending steps run as soon as the mode is not PAUSE."""
        ...

    def quit(self, status: int) -> None:
        """End the simulator with the exit code `status`, after the response to the current call."""
        ...

    def reload(self) -> None:
        """Load the world file again, after the response to the current call."""
        ...

    def load(self, path: str) -> bool:
        """Load another world, after the response to the current call; return False if that is impossible."""
        ...

    def restart(self, robot: Robot) -> None:
        """Restart the controller of one robot, after the response to the current call."""
        ...
