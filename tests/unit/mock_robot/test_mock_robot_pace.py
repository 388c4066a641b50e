"""The clock of the mock robot, with a real time that the test sets."""

import pytest

from palaestra_sim.mock_robot.pace import Clock


class RealTime:
    """A real time that passes when the test lets it pass."""

    def __init__(self):
        self.s = 100.0

    def __call__(self):
        """Return the seconds."""
        return self.s


@pytest.fixture
def real():
    """Return the real time of a test."""
    return RealTime()


def test_robot_time_is_real_time_times_the_speed(real):
    """Tests of 10 minutes of driving must be possible in 30 s."""
    clock = Clock(20.0, start_s=0.5, most_behind_s=10.0, monotonic=real)
    real.s += 0.1

    assert clock.now_s() == pytest.approx(2.5)
    assert clock.real_s(0.2) == pytest.approx(0.01)


def test_the_robot_catches_up_after_a_short_delay(real):
    """A thread that wakes up late must not slow the robot."""
    clock = Clock(1.0, most_behind_s=0.1, monotonic=real)
    real.s += 0.09

    assert clock.behind_s(0.0) == pytest.approx(0.09)
    assert clock.lost_s == 0.0


def test_after_a_long_delay_the_clock_loses_time(real):
    """If the clock ran on, the dead man's switch would stop the robot because the mock itself was slow."""
    clock = Clock(20.0, most_behind_s=0.1, monotonic=real)
    real.s += 1.0

    assert clock.now_s() == pytest.approx(0.1)
    assert clock.behind_s(0.0) == pytest.approx(0.1)
    assert clock.lost_s == pytest.approx(19.9)


def test_no_command_comes_from_the_future(real):
    """If the clock went back after a delay, a command of that time would be valid for more than 200 ms."""
    clock = Clock(1.0, most_behind_s=0.1, monotonic=real)
    real.s += 3.0
    stamped_s = clock.now_s()
    clock.behind_s(0.0)
    real.s += 0.05

    assert stamped_s == pytest.approx(0.1)
    assert clock.behind_s(0.1) == pytest.approx(0.05)
