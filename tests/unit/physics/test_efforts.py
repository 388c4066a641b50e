"""Clients set and read the torques and forces of motors, under MuJoCo."""

import math

import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin

G = 9.81
ARM = b"""#VRML_SIM R2023b utf8
WorldInfo { basicTimeStep 8 }
Robot { name "crane" translation 0 0 1 boundingObject Box { size 0.2 0.2 0.2 } children [
  HingeJoint {
    jointParameters HingeJointParameters { axis 0 0 1 }
    device RotationalMotor { name "turn" maxTorque 20 }
    endPoint Solid { translation 0 0 0.5 boundingObject Cylinder { radius 0.1 height 0.3 }
      physics Physics { density -1 mass 8 } } }
  SliderJoint {
    jointParameters JointParameters { axis 0 0 1 minStop -0.4 maxStop 0.4 }
    device LinearMotor { name "lift" maxForce 100 }
    endPoint Solid { translation 0.5 0 0 boundingObject Box { size 0.1 0.1 0.1 }
      physics Physics { density -1 mass 3 } } } ] }
"""


@pytest.fixture
def crane():
    """Return a simulation with a crane, and its motors."""
    simulation = Simulation.load(ARM, MujocoPhysics(), "crane", Mode.FAST)
    return simulation, simulation.robots[0].motors


def rows(robot, name):
    """Return the services of a motor, by path, and its list of topics."""
    kind, motor = robot.parts.devices.rows[name]
    return {path: handler for path, _, handler in kind.services(motor)}, kind.topics(motor)


def test_a_torque_speeds_a_cylinder_up(crane):
    """A torque of 2 N m on an inertia of m r^2 / 2 = 0.04 kg m2 gives 50 rad/s2."""
    simulation, motors = crane
    motors["turn"].set_effort(2.0)

    simulation.step(400)

    assert motors["turn"].speed_rad_s == pytest.approx(50.0 * 0.4, rel=1e-3)
    assert motors["turn"].feedback_nm == 2.0


def test_a_torque_is_clamped_and_lasts_until_a_position(crane):
    """As in Webots, a new velocity does not end the torque, but a new position does."""
    simulation, motors = crane
    motors["turn"].set_effort(1000.0)
    motors["turn"].set_velocity(0.0)
    assert motors["turn"].effort_nm == 20.0
    simulation.step(80)
    assert motors["turn"].speed_rad_s > 10.0

    motors["turn"].set_position(math.inf)
    simulation.step(400)

    assert motors["turn"].speed_rad_s == pytest.approx(0.0, abs=1e-3)


def test_a_force_that_carries_the_weight_keeps_it_at_rest(crane):
    """With one newton more than its weight, the load rises with a third of a meter per second squared."""
    simulation, motors = crane
    motors["lift"].set_effort(3.0 * G)
    simulation.step(400)
    assert motors["lift"].angle_rad == pytest.approx(0.0, abs=1e-6)

    motors["lift"].set_effort(3.0 * G + 1.0)
    simulation.step(400)

    assert motors["lift"].speed_rad_s == pytest.approx(0.4 / 3.0, rel=1e-3)


def test_the_feedback_of_a_lift_is_the_weight_that_it_holds(crane):
    """The feedback is the motor's force against gravity, in newtons. Without an available force it is 0."""
    simulation, motors = crane
    simulation.step(800)
    assert motors["lift"].feedback_nm == pytest.approx(3.0 * G, rel=1e-6)

    motors["lift"].set_available_torque(0.0)
    simulation.step(80)

    assert motors["lift"].feedback_nm == 0.0
    assert motors["lift"].speed_rad_s == pytest.approx(-G * 0.08, rel=1e-3)


def test_a_motor_publishes_its_feedback(crane):
    """The service `enable` has the path of the feedback sensor, but the topic has the path of the motor."""
    simulation, _ = crane
    robot = simulation.robots[0]
    simulation.step(800)

    services, (topic,) = rows(robot, "lift")

    assert (topic.name, topic.type_name) == ("force_feedback", "webots_ros/Float64Stamped")
    assert topic.source.value == pytest.approx(3.0 * G, rel=1e-6)
    assert "force_feedback_sensor/enable" not in services
    assert robot.parts.devices.rows["lift"][0].sensor == "force_feedback_sensor"


def test_a_reset_ends_a_torque(crane):
    """A reset clears the torque that a client set, so the motor is as in a new world."""
    simulation, motors = crane
    motors["turn"].set_effort(2.0)
    simulation.step(80)

    simulation.reset()
    simulation.step(80)

    assert motors["turn"].effort_nm is None
    assert motors["turn"].angle_rad == pytest.approx(0.0, abs=1e-9)


def test_a_driving_wheel_refuses_a_torque():
    """The base moves as a whole, so a torque on one wheel has no meaning."""
    robot = Simulation.load(builtin("arena"), MujocoPhysics()).robots[0]
    services, topics = rows(robot, "wheel0_joint")

    with pytest.raises(UnsimulatedError, match="a torque does not move a driving wheel"):
        services["set_torque"](None)
    assert not topics


def test_the_stub_has_no_feedback():
    """The stub computes no forces, so the feedback services of a motor return failure."""
    services, topics = rows(Simulation.load(ARM, StubPhysics()).robots[0], "lift")

    with pytest.raises(UnsimulatedError, match="forces are not simulated; set a position or velocity"):
        services["set_force"](None)
    assert not topics
    assert "force_feedback_sensor/enable" in services
