"""Simulations of world files with the physics of the stub."""

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics


def load_scene(source, name="world", mode=Mode.REAL_TIME):
    """Return the simulation of a world file that needs no other file."""
    return Simulation.load(source, StubPhysics(), name, mode)
