"""One suite for every physics under the scene: what a robot, a sensor and a supervisor may expect of it."""

import math

import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin

STEP_MS = 192


@pytest.fixture(params=[StubPhysics, MujocoPhysics], ids=["stub", "mujoco"])
def physics(request):
    """Return the physics of a new world."""
    return request.param


@pytest.fixture
def load(physics):
    """`load(source)`: the simulation of a world; without one, of the arena."""

    def load(source=None):
        return Simulation.load(source or builtin("arena"), physics(), "world", Mode.FAST)

    return load


@pytest.fixture
def drive():
    """`drive(simulation, vx, vy, omega, steps)`: command the first robot, and step."""

    def drive(simulation, vx, vy, omega, steps=1):
        robot = simulation.robots[0]
        speeds = robot.body.base.drive.wheel_speeds(vx, vy, omega)
        for motor, speed in zip(robot.motors.values(), speeds, strict=True):
            motor.set_position(math.inf)
            motor.set_velocity(speed)
        for _ in range(steps):
            simulation.step(STEP_MS)
        return robot.body

    return drive
