"""Devices for worlds with users' own robots."""

import pytest

from palaestra_trainer.webots import Motor, PositionSensor

WHEEL_RAD_S = 5.0


def test_a_position_sensor_tells_how_far_its_joint_has_turned(arena):
    """A user needs the total angle over all turns, in radians, and the change of the angle in each step."""
    wheel, sensor = Motor("robotino", "wheel0_joint"), PositionSensor("robotino", "wheel0_joint_sensor")
    arena.robot.simulation.add([sensor], [wheel])
    arena.robot.connect()
    arena.robot.advance()
    rest = sensor.value

    wheel.set_velocity(WHEEL_RAD_S)
    arena.robot.advance()
    begun = sensor.value
    for _ in range(10):
        arena.robot.advance()

    assert rest == 0.0
    assert 0.0 < begun < WHEEL_RAD_S * 0.192
    assert sensor.value - begun == pytest.approx(10 * WHEEL_RAD_S * 0.192, rel=0.05)
