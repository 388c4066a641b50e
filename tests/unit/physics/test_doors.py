"""Joints outside robots under MuJoCo: doors, pendulums, and carts without motors."""

import math

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin

DOOR = b"""
DEF FRAME Solid {
  translation 0.6 0.4 0
  boundingObject Box { size 0.06 0.06 0.6 }
  name "frame"
  children [ DEF HINGE HingeJoint {
    jointParameters HingeJointParameters { axis 0 0 1 dampingConstant 0.5 minStop -2 maxStop 2 }
    endPoint DEF DOOR Solid {
      translation 0 -0.4 0.35
      name "door"
      boundingObject Box { size 0.04 0.8 0.6 }
      physics Physics { density -1 mass 3 }
      children [ DEF KNOB Solid { translation 0 -0.3 0.05 boundingObject Box { size 0.1 0.04 0.04 } } ]
    }
  } ]
}
"""


@pytest.fixture
def load():
    """`load(text)` returns the built-in arena with the nodes of `text` added, under MuJoCo."""

    def load(text=DOOR):
        return Simulation.load(builtin("arena") + text, MujocoPhysics(), "doors", Mode.FAST)

    return load


def angle(simulation, name="DOOR"):
    """Return the position of a Solid's joint."""
    return simulation.tree.of_def(name).place.joint.now


def test_a_robot_pushes_a_door_open(load, drive):
    """Without a push the door stays shut in its frame. The knob moves together with the door."""
    simulation = load()
    simulation.step(1920)
    assert angle(simulation) == pytest.approx(0.0, abs=1e-3)

    drive(simulation, 0.3, 0.0, 0.0, steps=12)

    assert angle(simulation) > 0.5
    knob = simulation.tree.of_def("KNOB").place.world_pose
    assert knob.heading_rad == pytest.approx(angle(simulation))
    assert knob.position[0] > 0.9


def test_rays_meet_a_door_where_it_is(load):
    """A supervisor opens a door that has long been at rest.

    The robot's infra-red sensor must then measure a longer distance.
    """
    simulation = load()
    simulation.step(1920)
    ahead = simulation.robots[0].sensors["ir1"]
    shut = ahead.value

    simulation.set_joint_position(simulation.tree.of_def("HINGE"), 1.5, 1)
    simulation.step(32)

    assert ahead.value < 0.9 * shut
    assert angle(simulation) == pytest.approx(1.5, abs=1e-3)


def test_a_door_stops(load):
    """The joint has stops at 2 rad, so a door that is pushed hard stays within them."""
    simulation = load()
    simulation.tree.of_def("DOOR").place.joint.follow(0.0, 8.0)

    simulation.step(1920)

    assert angle(simulation) < 2.0 + math.radians(2.0)


def test_a_reset_shuts_a_door(load, drive):
    """The same commands after each of two resets move the door by the same angles, bit for bit."""
    simulation = load()

    def course():
        simulation.reset()
        simulation.advance(32)
        trace = []
        for _ in range(5):
            drive(simulation, 0.3, 0.0, 0.1, steps=2)
            trace.append(angle(simulation))
        return trace

    assert course() == course()
    assert angle(simulation) != 0.0


def test_reset_physics_stops_a_door(load):
    """A supervisor's `reset_physics` takes the door's velocity, so the door stays at its angle."""
    simulation = load()
    simulation.tree.of_def("DOOR").place.joint.follow(0.5, 2.0)
    simulation.step(32)

    simulation.reset_physics()
    before = angle(simulation)
    simulation.step(320)

    assert angle(simulation) == pytest.approx(before, abs=1e-3)


def test_an_imported_door_swings_and_another_keeps_its_angle(load, drive):
    """Importing a door compiles the model again, and the other door keeps its angle.

    Removing a door removes its joint too.
    """
    simulation = load()
    drive(simulation, 0.3, 0.0, 0.0, steps=12)
    before = angle(simulation)
    children = simulation.tree.field_of(simulation.tree.root, "children", simulation)
    text = DOOR.decode().replace("DEF DOOR", "DEF NEW").replace("0.6 0.4 0\n", "-1.2 1 0\n")
    simulation.add(text.replace("DEF FRAME", "DEF OTHER").replace("DEF HINGE", ""), children, -1)
    assert angle(simulation) == before

    simulation.tree.of_def("NEW").place.joint.follow(0.0, 1.0)
    simulation.step(64)

    assert angle(simulation, "NEW") > 0.03
    simulation.remove(simulation.tree.of_def("OTHER"))
    simulation.step(64)
    assert len(simulation.scene.doors) == 1


def test_a_pendulum_hangs_from_nothing():
    """A joint need not belong to a Solid or a Robot.

    Here it is a child of the world itself, whose y axis points up.
    """
    world = b"""#VRML_SIM R2023b utf8
    WorldInfo { basicTimeStep 8 coordinateSystem "NUE" }
    HingeJoint { jointParameters HingeJointParameters { axis 0 0 1 anchor 0 2 0 dampingConstant 1 }
      endPoint DEF BOB Solid { translation 1 2 0 boundingObject Sphere { radius 0.1 }
        physics Physics { density -1 mass 1 } } }"""
    simulation = Simulation.load(world, MujocoPhysics())

    simulation.step(16000)

    assert simulation.tree.of_def("BOB").place.world_pose.position == pytest.approx((0.0, 1.0, 0.0), abs=0.01)


def test_a_lid_swings_on_a_crate(load):
    """The lid's joint belongs to a dynamic solid, so the lid falls together with the crate."""
    crate = b"""DEF CRATE Solid {
      translation 0 1.2 1 boundingObject Box { size 0.3 0.3 0.3 } physics Physics { density -1 mass 5 }
      children [ HingeJoint {
        jointParameters HingeJointParameters { axis 0 1 0 anchor 0.15 0 0.15 dampingConstant 0.02 }
        endPoint DEF LID Solid { translation 0.2 0 0.3 rotation 0 1 0 0.2 name "lid"
          boundingObject Box { size 0.02 0.3 0.3 } physics Physics { density -1 mass 0.5 } } } ] }"""
    simulation = load(crate)

    simulation.step(4800)

    assert simulation.tree.of_def("CRATE").place.world_pose.position[2] == pytest.approx(0.15, abs=0.01)
    assert abs(angle(simulation, "LID")) > 1.0


def test_the_stub_refuses_doors():
    """The stub would make doors immovable, like walls, so it rejects the world."""
    with pytest.raises(WorldError, match="a Solid with physics moves when it is pushed"):
        Simulation.load(builtin("arena") + DOOR, StubPhysics())
