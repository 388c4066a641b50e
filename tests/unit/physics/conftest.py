"""Fixtures for tests that run once per physics: the behavior of robots, sensors and supervisors."""

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
    """Return the class of a physics."""
    return request.param


@pytest.fixture
def load(physics):
    """`load(source)` returns the simulation of a world; without a source, of the built-in arena."""

    def load(source=None):
        return Simulation.load(source or builtin("arena"), physics(), "world", Mode.FAST)

    return load


@pytest.fixture
def drive():
    """`drive(simulation, vx, vy, omega, steps)` drives the first robot and returns its body."""

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
