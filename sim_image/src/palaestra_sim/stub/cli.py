"""The program `palaestra-stub`."""

from __future__ import annotations

from collections.abc import Sequence

from palaestra_sim.program import Program
from palaestra_sim.stub.physics import StubPhysics

STUB = Program(
    name="palaestra-stub",
    description="Simulate a world with the ROS 1 interface of Webots' `ros` controller.",
    physics=StubPhysics,
)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the stub until a client or a signal ends it; return the exit code."""
    return STUB.run(arguments)
