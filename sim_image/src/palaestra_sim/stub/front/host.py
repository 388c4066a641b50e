"""The interface of the running stub for a controller and its services.

The stub starts and ends controllers, so it imports them; they import this Protocol instead of the stub.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Protocol

from palaestra_sim.stub.front.options import StubOptions
from palaestra_sim.stub.scene.arguments import Arguments
from palaestra_sim.stub.scene.mode import Mode
from palaestra_sim.stub.scene.robot import Robot


class Host(Protocol):
    """A running stub, from one world to the next.

    Attributes:
        world_path: the world that is loaded now.
        options: see StubOptions.
        clock: seconds of real time, from any start.
    """

    world_path: Path
    options: StubOptions
    clock: Callable[[], float]

    def arguments(self, robot: Robot) -> Arguments:
        """Return the controllerArgs of a robot whose controller is "ros"."""
        ...

    def set_mode(self, mode: Mode) -> None:
        """Pause or run; pending steps are made once the simulation runs."""
        ...

    def quit(self, status: int) -> None:
        """End with that exit status, after the answer to the current call."""
        ...

    def reload(self) -> None:
        """Load the world file again, after the answer of the present call."""
        ...

    def load(self, path: str) -> bool:
        """Load another world, after the answer of the present call; False: it cannot be loaded."""
        ...

    def restart(self, robot: Robot) -> None:
        """Restart the controller of one robot, after the answer of the present call."""
        ...
