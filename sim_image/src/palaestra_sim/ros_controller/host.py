"""The interface of the running simulator for a controller and its services.

The simulator starts and ends controllers, so it imports them; they import this Protocol instead.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from palaestra_sim.ros_controller.options import FrontOptions
from palaestra_sim.scene.arguments import ControllerArguments
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.robot import Robot


class Host(Protocol):
    """A running simulator, from one world to the next.

    Attributes:
        world_path: the world that is loaded now.
        options: see FrontOptions.
        clock: returns seconds of real time, from any origin.
    """

    world_path: Path
    options: FrontOptions
    clock: Callable[[], float]

    def arguments(self, robot: Robot) -> ControllerArguments:
        """Return the controllerArgs of a robot whose controller is "ros"."""
        ...

    def set_mode(self, mode: Mode) -> None:
        """Pause or run; pending steps run when the simulation does."""
        ...

    def quit(self, status: int) -> None:
        """End with that exit status, after the response to the current call."""
        ...

    def reload(self) -> None:
        """Load the world file again, after the response to the current call."""
        ...

    def load(self, path: str) -> bool:
        """Load another world, after the response to the current call; return False if it cannot be loaded."""
        ...

    def restart(self, robot: Robot) -> None:
        """Restart the controller of one robot, after the response to the current call."""
        ...
