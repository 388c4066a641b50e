"""The mock robot without its network: what moves it, and what it senses."""

import math

import pytest

from palaestra_sim.mock_robot.robot import Habits, MockRobot, MockRobotError
from palaestra_sim.world import builtin_path

PERFECT = Habits(drift=0.0)


@pytest.fixture
def robot():
    """Return a robot in the arena, with a perfect odometry."""
    return MockRobot(builtin_path("arena"), PERFECT)


def drive(robot, velocity, seconds):
    """Drive for some time, with a command at every step."""
    for _ in range(round(seconds * 1000.0 / robot.step_ms)):
        robot.command(velocity, robot.time_s)
        robot.advance(robot.step_ms)


@pytest.mark.parametrize("velocity", [(0.3, 0.0, 0.0), (0.0, 0.2, 0.0), (0.0, 0.0, 1.0), (0.2, -0.1, 0.5)])
def test_it_drives_as_commanded(robot, velocity):
    """The wheels must turn so that the robot has the velocity of the command."""
    drive(robot, velocity, 0.5)

    truth = robot.truth()
    assert (truth.vx, truth.vy, truth.omega) == pytest.approx(velocity, abs=1e-9)
    assert robot.odometry()[3:6] == pytest.approx(velocity, abs=1e-9)


def test_the_dead_mans_switch_stops_it(robot):
    """After one command, the robot drives for 200 ms and brakes; only robot time decides that."""
    robot.command((0.5, 0.0, 0.0), robot.time_s)
    robot.advance(10 * robot.step_ms)

    truth = robot.truth()
    assert (truth.vx, truth.omega) == (0.0, 0.0)
    assert 0.08 < truth.x < 0.13


def test_truth_counts_commands(robot):
    """A test of a program can check how often the program sends."""
    assert (robot.truth().commands, robot.truth().last_command_s) == (0, None)

    robot.command((0.0, 0.0, 0.0), 1.5)

    assert (robot.truth().commands, robot.truth().last_command_s) == (1, 1.5)


def test_without_drift_truth_and_odometry_agree(robot):
    """A test can then compare the two poses, after it has aligned their frames at the start."""
    start = robot.odometry()
    drive(robot, (0.3, 0.1, 0.4), 1.0)

    truth, (x, y, rot, *_) = robot.truth(), robot.odometry()
    c, s = math.cos(start[2]), math.sin(start[2])
    assert x - start[0] == pytest.approx(truth.x * c - truth.y * s)
    assert y - start[1] == pytest.approx(truth.x * s + truth.y * c)
    assert math.remainder(rot - start[2] - truth.heading, math.tau) == pytest.approx(0.0, abs=1e-9)


def test_a_person_carries_it_without_its_odometry(robot):
    """A real robot does not notice that a person carries it, so only the true pose may change."""
    before = robot.odometry()
    robot.place(0.0, 1.0, 7.0)

    assert robot.odometry() == before
    truth = robot.truth()
    assert (truth.x, truth.y) == (0.0, 1.0)
    assert truth.heading == pytest.approx(7.0 - math.tau)


def test_it_is_not_put_into_an_obstacle(robot):
    """The physics would push the robot out of the obstacle, so it would not be where the person put it."""
    with pytest.raises(MockRobotError, match=r"^x 2, y 0: an obstacle is there; choose a free place$"):
        robot.place(2.0, 0.0, 0.0)

    assert (robot.truth().x, robot.truth().y) == (0.0, 0.0)


def test_a_wall_presses_the_bumper_once(robot):
    """The bumper stays pressed while the robot stands at the wall, and a hit counts once."""
    robot.place(1.6, 0.0, 0.0)
    assert not robot.bumped()
    drive(robot, (0.5, 0.0, 0.0), 1.0)
    assert robot.bumped()
    robot.advance(20 * robot.step_ms)
    assert robot.bumped()
    assert robot.truth().contacts == 1

    drive(robot, (-0.3, 0.0, 0.0), 0.2)

    assert not robot.bumped()


def test_wheels_slip_at_a_wall(robot):
    """The odometry of a real robot counts the turns of the wheels, so it continues at an obstacle."""
    robot.place(1.7, 0.0, 0.0)
    drive(robot, (0.5, 0.0, 0.0), 0.5)

    assert robot.truth().vx == 0.0
    assert robot.odometry()[3] == pytest.approx(0.5)


def test_its_sensors_measure_meters(robot):
    """The first sensor looks ahead, the third one to the left, and the wall is 0.2 m away from the rim."""
    robot.place(1.5736, 0.0, 0.0)
    robot.advance(robot.step_ms)

    distances = robot.distances_m()
    assert len(distances) == 9
    assert distances[0] == pytest.approx(0.2, abs=0.01)
    assert distances[2] == 0.41


def test_noise_changes_distances_in_range_only():
    """A reading out of range is a constant of the robot, not a measurement."""
    robot = MockRobot(builtin_path("arena"), Habits(noise_m=0.05, seed=3))
    robot.place(1.5736, 0.0, 0.0)
    ahead, aside = [], []
    for _ in range(50):
        robot.advance(robot.step_ms)
        ahead.append(robot.distances_m()[0])
        aside.append(robot.distances_m()[2])

    assert max(ahead) - min(ahead) > 0.1
    assert min(ahead) >= 0.0
    assert set(aside) == {0.41}


def test_time_passes_in_whole_steps(robot):
    """The physics has a fixed step."""
    with pytest.raises(ValueError, match=r"^10 ms is not a positive multiple of 32 ms$"):
        robot.advance(10)


def test_a_world_without_a_robotino_is_refused(tmp_path):
    """The error must name the remedy, before the robot's port opens."""
    world = tmp_path / "other.wbt"
    world.write_bytes(builtin_path("arena").read_bytes().replace(b'"ir7"', b'"front"'))

    with pytest.raises(MockRobotError, match=r'^other\.wbt: the robot "robotino" lacks .*use a world with'):
        MockRobot(world, PERFECT)


def test_a_robot_with_other_wheels_is_refused(tmp_path):
    """The kinematics of the mock are those of a Robotino's three wheels."""
    world = tmp_path / "other.wbt"
    world.write_bytes(builtin_path("arena").read_bytes().replace(b'"wheel1_joint"', b'"left"'))

    with pytest.raises(MockRobotError, match=r"does not drive on the wheels wheel0_joint, "):
        MockRobot(world, PERFECT)
