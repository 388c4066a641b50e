"""The parts of the connection over ROS 2 that need no rclpy: addresses, scans, and a simulation's time."""

import math
import threading
from types import SimpleNamespace

import numpy as np
import pytest

from palaestra_trainer.cli.policy_node import separated
from palaestra_trainer.errors import ConfigurationError, LinkError, RobotUnfit
from palaestra_trainer.real_robots.connect import link_to
from palaestra_trainer.real_robots.robot_clock import RobotClock
from palaestra_trainer.real_robots.ros2_clock import SimulationClock, SimulationTime
from palaestra_trainer.real_robots.ros2_messages import distances_of
from palaestra_trainer.real_robots.sensor_layout import SensorLayout
from palaestra_trainer.waiting.check import go_on

RADIUS_M = 0.225
STEP = math.radians(40.0)


def scan(ranges, angle_min=0.0, angle_increment=STEP):
    """Return an object with the fields of a scan."""
    return SimpleNamespace(ranges=ranges, angle_min=angle_min, angle_increment=angle_increment)


@pytest.mark.parametrize(
    "address", ["ros2:robot1", "ros2:/robot 1", "ros2://host", "ros2:/1st", "ros2:/a//b", "ros2:/a?b=c"]
)
def test_an_address_that_is_not_a_namespace_is_refused(address):
    """ROS 2 finds the robot by its namespace and domain, so an address has no host."""
    with pytest.raises(ConfigurationError, match="is not an address such as ros2: or ros2:/robot1"):
        link_to(address, SensorLayout(), RobotClock())


@pytest.mark.parametrize("address", ["ros2:", "ros2:/robot1", "ros2:/fleet/robot1"])
def test_without_rclpy_the_message_names_the_remedy(address):
    """This environment has no rclpy, like a terminal in which nobody has sourced ROS 2."""
    with pytest.raises(ConfigurationError, match="is not installed; source the setup file of your ROS 2"):
        link_to(address, SensorLayout(), RobotClock())


def test_ranges_count_from_the_center_of_the_robot():
    """A scan has one origin, and the sensors lie on a circle around it."""
    ranges = [RADIUS_M + 0.1 + 0.02 * ray for ray in range(9)]

    found = distances_of(scan(ranges), SensorLayout())

    assert found == pytest.approx([0.1 + 0.02 * ray for ray in range(9)])
    assert found.dtype == np.float32


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_angles_decide_which_sensor_a_ray_belongs_to(sign):
    """A driver may begin behind the robot, or count clockwise."""
    bearings = [-sign * 4.0 * STEP + sign * ray * STEP for ray in range(9)]
    ranges = [RADIUS_M + 0.2 + 0.02 * round(bearing / STEP) for bearing in bearings]

    found = distances_of(scan(ranges, bearings[0], sign * STEP), SensorLayout())

    assert found == pytest.approx([0.2, 0.22, 0.24, 0.26, 0.28, 0.12, 0.14, 0.16, 0.18])


def test_a_ray_without_an_obstacle_has_the_greatest_distance():
    """ROS has infinity for such a ray, but the policy was trained with the limit of the sensor."""
    found = distances_of(scan([math.inf, *[RADIUS_M + 0.1] * 7, -math.inf]), SensorLayout())

    assert found == pytest.approx([0.40, *[0.1] * 7, 0.03])


@pytest.mark.parametrize(
    "message",
    [
        scan([0.3] * 8),
        scan([0.3] * 8 + [math.nan]),
        scan([0.3] * 9, angle_min=0.2),
        scan([0.3] * 9, angle_increment=0.0),
        scan([0.3] * 9, angle_increment=math.nan),
        scan([0.3] * 9, angle_increment=2.0 * math.pi),
    ],
)
def test_a_scan_of_another_sensor_is_refused(message):
    """The topic may have been remapped to a laser scanner."""
    with pytest.raises(LinkError, match="irsensor_scan"):
        distances_of(message, SensorLayout())


def test_a_simulation_that_begins_again_does_not_set_the_time_back():
    """If the time went back, old readings would count as newer than those of the new simulation."""
    times = iter([5.0, 6.0, 0.5, 1.5])
    time = SimulationTime(lambda: next(times))

    assert [time.now_s() for _ in range(4)] == [5.0, 6.0, 6.0, 7.0]


def test_a_wait_ends_when_the_simulation_has_reached_the_time():
    """A wait is in simulated time, so its real duration depends on the speed of the simulation."""
    times = iter([1.0, 1.1, 1.2, 1.3])
    clock = SimulationClock(time=SimulationTime(lambda: next(times)))

    assert clock.wait(threading.Event(), 1.25) is False
    assert next(times, None) is None


def test_at_the_end_a_paused_simulation_holds_nothing_up():
    """The last command makes the robot stand, and must be sent even if the simulation is paused."""
    clock = SimulationClock(time=SimulationTime(lambda: 1.0))
    clock.time.leave()

    assert clock.wait(threading.Event(), 1.01) is False
    assert 1.01 <= clock.now_s() < 60.0


def test_a_simulation_without_time_is_waited_for():
    """Before the first message of /clock, the time is 0, which is not yet the time of the simulation."""
    times = iter([0.0, 0.0, 0.1])
    checks = []

    SimulationTime(lambda: next(times)).refuse_unset(lambda: checks.append(1))

    assert len(checks) == 2


def test_the_wait_for_time_ends_when_the_check_raises():
    """A person ends the program while no simulation runs."""

    def check():
        raise RobotUnfit("ended")

    with pytest.raises(RobotUnfit, match="ended"):
        SimulationTime(lambda: 0.0).refuse_unset(check)
    SimulationTime(lambda: 0.1).refuse_unset(go_on)


@pytest.mark.parametrize(
    ("given", "own", "ros"),
    [
        (["p"], ["p"], []),
        (["p", "--ros-args", "-r", "a:=b"], ["p"], ["--ros-args", "-r", "a:=b"]),
        (["--ros-args", "-p", "a:=1", "--", "p"], ["p"], ["--ros-args", "-p", "a:=1", "--"]),
    ],
)
def test_arguments_of_ros_are_separated_from_those_of_the_program(given, own, ros):
    """Launch files of ROS 2 add their arguments at the end, and people also type them at the beginning."""
    assert separated(given) == (own, ros)
