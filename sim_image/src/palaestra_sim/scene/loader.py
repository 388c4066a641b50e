"""Load a simulation from the files of a world: the world itself, the PROTOs of its project, the stand-ins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.physics import Physics
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.world import builtin_protos, local_protos, parse
from palaestra_sim.world.bounded_read import read_bounded
from palaestra_sim.world.project_files import ProjectFiles
from palaestra_sim.world.stand_ins import StandIn, shipped


@dataclass(frozen=True, slots=True, kw_only=True)
class Loader:
    """Loads worlds for one kind of physics.

    Attributes:
        physics: returns a new physics for a world.
        stand_ins: the user's stand-ins, simple solids that replace PROTOs, by the name of the PROTO.
        leave_out: the nodes that the user leaves out, if they cannot be simulated.
    """

    physics: Callable[[], Physics]
    stand_ins: Mapping[str, StandIn] = field(default_factory=dict)
    leave_out: LeaveOut = field(default_factory=LeaveOut)

    def __call__(self, world_path: Path, mode: Mode) -> Simulation:
        """Return the simulation of a world and of the PROTOs in its project.

        The simulation starts in `mode`.

        Raises:
            WorldError: the file is wrong, or contains an object that cannot be simulated.
            OSError: the file cannot be read.
        """
        source = read_bounded(world_path)
        world = parse(source, world_path.name)
        found = local_protos(world_path, world, name=world_path.name, without=self.stand_ins)
        # A PROTO of the project overrides a built-in stand-in, and a stand-in of the user overrides both.
        solids = {name: entry for name, entry in shipped().items() if name not in found.local}
        descriptions = Descriptions(
            protos={**builtin_protos(), **found.local},
            stand_ins={**solids, **self.stand_ins},
            unusable=found.refused,
            read=ProjectFiles(world_path, source).read,
        )
        return Simulation.of(world, self.physics(), world_path.name, mode, descriptions, self.leave_out)
