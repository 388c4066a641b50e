"""`palaestra-mujoco`."""

from __future__ import annotations

import importlib
from collections.abc import Sequence

from palaestra_sim.program import Program
from palaestra_sim.scene.physics import Physics


def _physics() -> Physics:
    """Return the physics of a world.

    Raises:
        MissingLibraryError: MuJoCo is not installed.
    """
    # Here, so that the program can report the error as its own, and `--help` needs no MuJoCo.
    physics: Physics = importlib.import_module("palaestra_sim.mujoco.physics").MujocoPhysics()
    return physics


MUJOCO = Program(
    name="palaestra-mujoco",
    description="Simulate a world with MuJoCo, and answer over ROS 1 like the `ros` controller of Webots.",
    physics=_physics,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until a client or a signal ends it; return the exit code."""
    return MUJOCO.run(arguments)
