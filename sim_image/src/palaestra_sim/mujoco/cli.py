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


def _batched() -> Physics:
    """Return the physics of a world for `_serve_batch`: with a contact sensor for each part of a robot.

    Raises:
        MissingLibraryError: MuJoCo is not installed.
    """
    physics: Physics = importlib.import_module("palaestra_sim.mujoco.physics").MujocoPhysics(feeling=True)
    return physics


def _check_batch(simulation: Backend, world: Path) -> None:
    """Check that copies of a world can be simulated.

    Raises:
        BatchRefusedError: the world has parts that the batch form does not simulate.
    """
    importlib.import_module("palaestra_sim.mujoco.batched.program").batch_of(simulation, world.name, 1, 1)


def _serve_batch(simulation: Backend, world: Path, rows: int, threads: int) -> int:
    """Serve copies of a world until a signal; return the exit code.

    Raises:
        BatchRefusedError: the world has parts that the batch form does not simulate.
    """
    serving = importlib.import_module("palaestra_sim.mujoco.batched.program")
    code: int = serving.serve(simulation, world, rows, threads)
    return code


MUJOCO = Program(
    name="palaestra-mujoco",
    description="Simulate a world in MuJoCo with the ROS 1 interface of Webots' `ros` controller.",
    physics=_physics,
    mjcf=_mjcf,
    batched=_batched,
    check_batch=_check_batch,
    serve_batch=_serve_batch,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until a client or a signal ends it; return the exit code."""
    return MUJOCO.run(arguments)
