"""Gains, multipliers and torques of motors, in every physics."""

import math

import pytest

from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation

ARMS = """#VRML_SIM R2023b utf8
WorldInfo { basicTimeStep 8 gravity 0 }
DEF R Robot {
  children [
    HingeJoint {
      jointParameters HingeJointParameters { axis 0 0 1 anchor 0 0 1 }
      device [ RotationalMotor { name "arm" FIELDS } PositionSensor { name "angle" } ]
      endPoint Solid {
        translation 0.2 0 1 boundingObject Box { size 0.1 0.02 0.02 } physics Physics { density -1 mass 0.1 }
      }
    }
  ]
  boundingObject Box { size 0.05 0.05 0.05 } physics Physics { density -1 mass 5 }
  controller "ros" controllerArgs [ "--name=rob" "--synchronize" ]
}
"""


@pytest.fixture
def arm(physics):
    """`arm(fields)` returns a simulation of a robot with an arm, whose motor has these fields."""
    return lambda fields="": Simulation.load(
        ARMS.replace("FIELDS", fields).encode(), physics(), "world", Mode.FAST
    )


def angle(simulation):
    """Return the reading of the position sensor of the arm, in radians."""
    return simulation.robots[0].sensors["angle"].value


@pytest.mark.parametrize("fields", ["controlPID 1 0 0", ""])
def test_a_small_gain_needs_longer_to_a_target(arm, fields):
    """With a small gain the motor moves slower. The gain comes from the world file or from a client."""
    simulation = arm(fields)
    motor = simulation.robots[0].motors["arm"]
    if not fields:
        motor.set_control_pid(1.0, 0.0, 0.0)
    motor.set_position(1.0)

    for _ in range(125):
        simulation.step(8)

    assert angle(simulation) == pytest.approx(1.0 - (1.0 - 0.008) ** 125, abs=0.02)


def test_a_multiplier_moves_the_arm_further(arm):
    """A multiplier of 2 doubles the target position. Only the world file can set the multiplier."""
    simulation = arm("multiplier 2")
    simulation.robots[0].motors["arm"].set_position(0.25)

    simulation.step(1600)

    assert angle(simulation) == pytest.approx(0.5, abs=1e-3)


def test_a_motor_without_torque_moves_nothing(arm):
    """With an available torque of 0 the motor follows neither a target position nor a velocity."""
    simulation = arm()
    motor = simulation.robots[0].motors["arm"]
    motor.set_available_torque(0.0)
    motor.set_position(math.inf)
    motor.set_velocity(2.0)

    simulation.step(800)

    assert angle(simulation) == pytest.approx(0.0, abs=1e-9)
