"""The behavior of the driver for ROS 1: it limits each command, and forwards it once."""

import math

import pytest

from palaestra_sim.mock_robot.driver import CommandSlot, Limits, points


@pytest.mark.parametrize(
    ("command", "forwarded"),
    [
        ((0.5, -0.3, 2.0), (0.2, -0.2, 1.0)),
        ((0.1, 0.2, -1.0), (0.1, 0.2, -1.0)),
        ((0.01, -0.01, 0.02), (0.05, -0.05, 0.1)),
        ((0.3, 0.01, -0.05), (0.2, 0.05, -0.1)),
        ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0)),
    ],
    ids=["clipped", "unchanged", "raised", "each axis by itself", "zero"],
)
def test_the_driver_limits_each_axis_by_itself(command, forwarded):
    """The driver logs no limited command, so a policy that was trained with 0.5 m/s drives differently."""
    assert Limits().within(command) == forwarded


def test_a_launch_file_may_raise_the_limit():
    """The usual launch file has 0.5 m/s, and the default of the driver is 0.2 m/s."""
    assert Limits(max_linear_vel=0.5).within((0.45, 0.6, 0.0)) == (0.45, 0.5, 0.0)


def test_a_command_is_forwarded_once():
    """The driver has no watchdog of its own, so it must not repeat a command of a client that has died."""
    slot = CommandSlot(Limits())
    slot.put((0.1, 0.0, 0.0))

    assert slot.take() == (0.1, 0.0, 0.0)
    assert slot.take() is None


def test_only_the_newest_command_of_a_period_is_forwarded():
    """The driver's subscriber has a queue of one message."""
    slot = CommandSlot(Limits())
    slot.put((0.2, 0.0, 0.0))
    slot.put((0.0, 0.0, 0.0))

    assert slot.take() == (0.0, 0.0, 0.0)


def test_a_distance_is_a_point_in_front_of_its_sensor():
    """Sensor i looks 40 * i degrees to the left, and stands 0.2 m from the center."""
    nine = points([0.1 * number for number in range(9)])

    assert nine[0] == (0.2, 0.0, 0.05)
    assert [math.hypot(x, y) - 0.2 for x, y, _ in nine] == pytest.approx([0.1 * it for it in range(9)])
    assert math.degrees(math.atan2(nine[2][1], nine[2][0])) == pytest.approx(80.0)
