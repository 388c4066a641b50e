"""Forces and torques of a supervisor, under MuJoCo; the stub refuses them."""

import math

import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics

WORLD = b"""#VRML_SIM R2023b utf8
WorldInfo { basicTimeStep 32 }
DEF PUCK Solid {
  translation 0 0 5
  rotation 0 0 1 1.5707963
  boundingObject Box { size 0.2 0.2 0.2 }
  physics Physics { density -1 mass 2 }
}
"""


@pytest.fixture
def thrown():
    """`thrown(push)` returns the motion of a falling puck one step after `push(motion, node)`.

    The motion is the puck's velocity and rotation.
    """

    def thrown(push):
        simulation = Simulation.load(WORLD, MujocoPhysics(), "puck", Mode.FAST)
        node = simulation.tree.of_def("PUCK")
        push(simulation.motion, node)
        simulation.step(32)
        return simulation.motion.velocity(node)

    return thrown


def test_a_force_acts_for_one_basic_step(thrown):
    """A force of ten newtons acts on two kilograms for one step of 32 ms, which gives 0.16 m/s."""
    velocity, _ = thrown(lambda motion, node: motion.add_force(node, (10.0, 0.0, 0.0), relative=False))

    assert velocity == pytest.approx((0.16, 0.0, -9.81 * 0.032), abs=1e-6)


def test_a_relative_force_turns_with_the_node(thrown):
    """The node is turned, so that its x axis, along which the force acts, points along y of the world."""
    velocity, _ = thrown(lambda motion, node: motion.add_force(node, (10.0, 0.0, 0.0), relative=True))

    assert velocity[:2] == pytest.approx((0.0, 0.16), abs=1e-6)


def test_a_force_beside_the_center_turns(thrown):
    """A force at a distance from the center turns the puck.

    As in Webots, the offset is in the frame of the node.
    """
    _, turning = thrown(
        lambda motion, node: motion.add_force(node, (1.0, 0.0, 0.0), relative=False, offset=(0.1, 0.0, 0.0))
    )

    assert turning[2] < -0.1


def test_a_torque_turns_in_place(thrown):
    """A torque moves no center of mass. The inertia of a cube of 2 kg with sides of 0.2 m is 1/75 kg m2."""
    velocity, turning = thrown(lambda motion, node: motion.add_torque(node, (0.0, 0.0, 0.5), relative=False))

    assert velocity[:2] == pytest.approx((0.0, 0.0), abs=1e-6)
    assert turning[2] == pytest.approx(0.5 * 75.0 * 0.032, rel=1e-3)


def test_a_velocity_of_a_loose_thing_is_what_was_set(thrown):
    """One step after a supervisor has set a velocity, only gravity has changed it."""
    velocity, turning = thrown(
        lambda motion, node: motion.set_velocity(node, (1.0, 2.0, 0.0), (0.0, 0.0, math.pi))
    )

    assert velocity == pytest.approx((1.0, 2.0, -9.81 * 0.032), abs=1e-6)
    assert turning[2] == pytest.approx(math.pi)


def test_halting_stops_a_loose_thing(thrown):
    """A supervisor's `reset_physics` stops the puck."""

    def push(motion, node):
        motion.set_velocity(node, (1.0, 2.0, 0.0), (0.0, 0.0, 1.0))
        motion.halt(node)

    assert thrown(push)[0][:2] == (0.0, 0.0)


def test_the_stub_refuses_forces():
    """If the stub reported success but nothing moved, the client would be misled."""
    simulation = Simulation.load(WORLD.replace(b"physics Physics { density -1 mass 2 }", b""), StubPhysics())
    node = simulation.tree.of_def("PUCK")

    with pytest.raises(UnsimulatedError, match="the stub simulates no torques; use driver mujoco or webots"):
        simulation.motion.add_torque(node, (0.0, 0.0, 1.0), relative=False)
