"""Scenes and simulations of world files with the physics of the stub."""

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.reader import read_scene
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.scene_tree import SceneTree
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import parse


def load_scene(source, name="world", mode=Mode.REAL_TIME):
    """Return the simulation of a world file that needs no other file."""
    return Simulation.load(source, StubPhysics(), name, mode)


def scene_of(source):
    """Return the scene of a world file, which messages call my.wbt."""
    return read_scene(SceneTree(parse(source), "my.wbt"), StubPhysics())
