"""The simulator that a place starts; pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatorRequest:
    """The simulator that a place starts.

    Attributes:
        world: path of the world, or the name of a world that Palaestra ships.
        driver: the simulator program, `stub`, `mujoco` or `webots`.
        options: command-line options for the simulator.
        suffix: text that is appended to the ROS names in the world.
    """

    world: str | Path
    driver: str = "stub"
    options: Sequence[str] = ()
    suffix: str = ""
