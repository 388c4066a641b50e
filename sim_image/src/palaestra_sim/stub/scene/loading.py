"""A simulation from the files of a world: the world itself, the PROTOs of its project, the stand-ins."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from palaestra_sim.stub.scene.mode import Mode
from palaestra_sim.stub.scene.nodes.growing import Descriptions
from palaestra_sim.stub.scene.reading import LeaveOut
from palaestra_sim.stub.scene.simulation import Simulation
from palaestra_sim.world import builtin_protos, local_protos, parse
from palaestra_sim.world.stand_ins import StandIn, shipped


def read_world(
    world_path: Path, mode: Mode, *, stand_ins: Mapping[str, StandIn], leave_out: LeaveOut
) -> Simulation:
    """Return the simulation of a world and of the PROTOs in its project.

    Args:
        world_path: the .wbt file.
        mode: how it runs at first.
        stand_ins: the user's own simple solids in place of PROTOs, by name.
        leave_out: what the user leaves out, if it cannot be simulated.

    Raises:
        WorldError: the file is wrong, or holds something that the stub cannot simulate.
        OSError: it cannot be read.
    """
    world = parse(world_path.read_bytes(), world_path.name)
    found = local_protos(world_path, world, name=world_path.name, without=stand_ins)
    # A PROTO of the project is what its author means; a stand-in of the user's comes before it.
    solids = {name: entry for name, entry in shipped().items() if name not in found.local}
    descriptions = Descriptions(
        protos={**builtin_protos(), **found.local},
        stand_ins={**solids, **stand_ins},
        unusable=found.refused,
    )
    return Simulation.of(world, world_path.name, mode, descriptions, leave_out)
