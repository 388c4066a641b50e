"""The program `palaestra-mujoco`."""

from __future__ import annotations

import importlib
from collections.abc import Sequence
from pathlib import Path

from palaestra_sim.program import Program
from palaestra_sim.ros_controller.backend import Backend
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.physics import Physics
from palaestra_sim.scene.validation import LeaveOut

# The functions of this module import MuJoCo, because an import at the top of this module would fail without
# MuJoCo. So `--help` always works, and the program can report a missing MuJoCo as an error with a remedy.


def _physics() -> Physics:
    """Return the physics of a world.

    Raises:
        MissingLibraryError: MuJoCo is not installed.
    """
    physics: Physics = importlib.import_module("palaestra_sim.mujoco.physics").MujocoPhysics()
    return physics


def _mjcf(world_path: Path, mode: Mode, leave_out: LeaveOut, root: Path | None) -> Backend:
    """Return the simulation of an MJCF world.

    Raises:
        MissingLibraryError: MuJoCo is not installed.
        WorldError: the world is wrong.
        OSError: the world cannot be read.
    """
    loading = importlib.import_module("palaestra_sim.mujoco.mjcf.loader")
    simulation: Backend = loading.load(world_path, mode, leave_out, root=root)
    return simulation


MUJOCO = Program(
    name="palaestra-mujoco",
    description="Simulate a world in MuJoCo with the ROS 1 interface of Webots' `ros` controller.",
    physics=_physics,
    mjcf=_mjcf,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until a client or a signal ends it; return the exit code."""
    return MUJOCO.run(arguments)
