"""A robot that drives, the values of its sensors, and the random numbers of their noise."""

import math
import random

from tests.robotino import WHEELS, wheel_speeds

STEP_MS = 32
NORTH = "rotation 0 0 1 1.5707963267948966"  # the robot looks along +y
ON_A_TURNTABLE = """HingeJoint {{
  jointParameters HingeJointParameters {{ axis 0 0 1 }}
  device RotationalMotor {{ name "turntable" }}
  endPoint Solid {{ children [ {} ] physics Physics {{ }} }} }}"""


def drive(simulation, vx, vy, omega, steps=30):
    """Drive until the robot has reached that velocity."""
    motors = simulation.robots[0].motors
    for name, speed in zip(WHEELS, wheel_speeds(vx, vy, omega), strict=True):
        motors[name].set_position(math.inf)
        motors[name].set_velocity(speed)
    for _ in range(steps):
        simulation.step(STEP_MS)


def value_of(simulation, name):
    """Return the value of a sensor of the first robot."""
    return simulation.robots[0].sensors[name].value


def draws(count):
    """Return the first random numbers of the noise with seed 7."""
    noise = random.Random(7)
    return [noise.gauss(0.0, 1.0) for _ in range(count)]
