"""Worlds of users, whose PROTOs are given as text or are bundled."""

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin_protos, parse, parse_proto
from palaestra_sim.world.stand_ins import shipped

HEAD = "#VRML_SIM R2023b utf8\n"


def load_world(text, *protos, stand_ins=None, leave_out=None):
    """Return the simulation of a world that may use these PROTOs and the bundled ones."""
    own = [parse_proto(f"{HEAD}{proto}".encode(), "Own.proto") for proto in protos]
    descriptions = Descriptions(
        protos={**builtin_protos(), **{proto.name: proto for proto in own}},
        stand_ins=shipped() if stand_ins is None else stand_ins,
    )
    world = parse(f"{HEAD}WorldInfo {{ basicTimeStep 16 }} {text}".encode(), "my.wbt")
    return Simulation.of(world, StubPhysics(), "my.wbt", Mode.FAST, descriptions, leave_out)


def obstacles(simulation):
    """Return the shape, x, y and size of each obstacle, rounded to millimeters."""
    found = []
    for shape in simulation.scene.solids:
        x, y, _ = shape.pose.position
        found.append((shape.kind, round(x, 3), round(y, 3), tuple(round(it, 3) for it in shape.size)))
    return found
