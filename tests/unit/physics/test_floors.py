"""Floors stop the rays that point down and the dynamic solids that fall."""

import math

import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.fields import FieldType

WORLD = """#VRML_SIM R2023b utf8
WorldInfo {{ basicTimeStep 16 }}
DEF FLOOR Solid {{ translation 0 0 -1 boundingObject Plane {{ size 20 20 }} name "floor" }}
{}
Robot {{ translation 0 0 -1
  children [ DistanceSensor {{ name "down" translation 0 0 1.5 rotation 0 1 0 1.2 type "laser"
    lookupTable [ 0 0 0, 5 5 0 ] }} ]
  name "r" controller "ros" controllerArgs [ "--name=rob" "--synchronize" ] supervisor TRUE
}}
"""
CRATE = """DEF CRATE Solid { translation 2 0 -0.5 boundingObject Box { size 0.2 0.2 0.2 }
  physics Physics { density -1 mass 1 } name "crate" }"""


def test_a_ray_meets_the_floor_where_the_world_has_it(physics):
    """The floor of this world is at a height of -1 m.

    The ray must meet the floor there, and also after a supervisor has moved the floor.
    """
    simulation = Simulation.load(WORLD.format("").encode(), physics(), "world", Mode.FAST)
    sensor = simulation.robots[0].sensors["down"]
    simulation.step(16)
    assert sensor.value == pytest.approx(1.5 / math.sin(1.2))

    floor = simulation.tree.of_def("FLOOR")
    simulation.tree.field_of(floor, "translation", simulation).set(FieldType.VEC3F, 0, (0.0, 0.0, -2.0))
    simulation.step(16)

    assert sensor.value == pytest.approx(2.5 / math.sin(1.2))


def test_a_crate_falls_to_the_floor_of_the_world():
    """The crate comes to rest on the floor of the world, which is not at height 0."""
    simulation = Simulation.load(WORLD.format(CRATE).encode(), MujocoPhysics(), "world", Mode.FAST)

    simulation.step(1600)

    assert simulation.tree.of_def("CRATE").place.world_position[2] == pytest.approx(-0.9, abs=1e-3)
