"""`palaestra-mujoco`."""

from __future__ import annotations

from collections.abc import Sequence

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.program import Program

MUJOCO = Program(
    name="palaestra-mujoco",
    description="Simulate a world with MuJoCo, and answer over ROS 1 like the `ros` controller of Webots.",
    physics=MujocoPhysics,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the simulator until a client or a signal ends it; return the exit code."""
    return MUJOCO.run(arguments)
