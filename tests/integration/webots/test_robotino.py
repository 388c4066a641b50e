"""The simulated Robotino in a running stub."""

import math

import numpy as np
import pytest

from palaestra_trainer.errors import NoReading, NoSuchSensor, WrongData
from palaestra_trainer.robots import Movement, Pose
from palaestra_trainer.robots.infrared import meters
from palaestra_trainer.robots.robotino import Robotino

START = Pose(-1.5, 0.0, 0.0)


def test_it_drives_as_commanded(arena):
    """At 0.5 m/s for about a second, the robot drives almost half a meter, because it accelerates first."""
    arena.scene.reset(1, START, (1.0, 0.0))

    arena.robot.move(Movement.FORWARD)
    for _ in range(5):
        arena.robot.advance()

    pose = arena.robot.pose()
    assert -1.1 < pose.x_m < -1.0
    assert (pose.y_m, pose.heading_rad) == pytest.approx((0.0, 0.0), abs=1e-6)


@pytest.mark.parametrize("heading", [0.0, 1.0, -2.5, math.pi])
def test_a_reset_puts_it_where_the_episode_begins(arena, heading):
    """Heading 0 is included, because Webots refuses the quaternion of this heading."""
    arena.scene.reset(1, Pose(0.2, -1.5, 2.0), (1.0, 0.0))
    arena.scene.reset(2, Pose(1.4, 0.1, heading), (0.0, 1.5))

    pose = arena.robot.pose()

    assert (pose.x_m, pose.y_m) == pytest.approx((1.4, 0.1), abs=1e-6)
    assert math.remainder(pose.heading_rad - heading, 2 * math.pi) == pytest.approx(0.0, abs=1e-5)


def test_after_a_reset_it_stands_and_obeys(arena):
    """A reset ends the motors' velocity control; the facade must restore this control."""
    arena.scene.reset(1, START, (1.0, 0.0))
    arena.robot.drive(0.5, 0.0, 0.0)
    arena.robot.advance()
    arena.scene.reset(2, START, (1.0, 0.0))

    before = arena.robot.pose()
    arena.robot.advance()

    assert arena.robot.pose() == before


def test_the_same_seed_gives_the_same_readings(arena):
    """A user repeats an experiment by its seed, which also determines the sensors' noise."""

    def readings(seed):
        arena.scene.reset(seed, Pose(-1.0, 0.0, 0.3), (1.0, 0.0))
        arena.robot.drive(0.3, 0.1, 0.5)
        return [(arena.robot.advance(), *arena.robot.distances()) for _ in range(10)]

    first, again, other = readings(7), readings(7), readings(8)

    assert first == again
    assert first != other


def test_it_feels_a_wall(arena):
    """The front sensor must measure the wall before the bumper touches it."""
    arena.scene.reset(1, Pose(1.0, 0.0, 0.0), (-1.0, 0.0))
    arena.robot.drive(0.5, 0.0, 0.0)

    seen = []
    while not arena.robot.bumped() and len(seen) < 20:
        arena.robot.advance()
        seen.append(float(arena.robot.distances()[0]))

    assert arena.robot.bumped()
    assert min(seen) < 0.08
    assert np.argmin(arena.robot.distances()) == 0


def test_volts_become_metres_within_the_sensors_range():
    """The facade returns meters, as the real robot does."""
    read = [meters(volts) for volts in (3.03, 0.82, 0.31, 0.0)]

    assert read == pytest.approx([0.0327, 0.16, 0.40, 0.40], abs=0.01)


def test_it_has_no_camera(arena):
    """An environment can catch this type of error, and then work without images."""
    with pytest.raises(NoSuchSensor, match="has no device camera"):
        arena.robot.use_cameras(color=True)
    with pytest.raises(NoSuchSensor, match=r"call use_cameras\(depth=True\), then advance"):
        arena.robot.depth_image()

    assert arena.robot.advance() == 0


def test_cameras_that_a_simulator_does_not_render_are_refused(start):
    """The world has cameras, but the stub renders no images."""
    seeing = start(world="seeing")

    with pytest.raises(NoSuchSensor, match="such as driver mujoco"):
        seeing.robot.use_cameras(color=True)

    assert seeing.robot.advance() == 0


def test_a_lost_wake_up_costs_an_extra_step_and_no_fault(start):
    """The real controller, too, can miss a step request that comes too early."""
    arena = start("--lost-wakeup", "--publish-delay-ms=50")  # the next request comes within this delay

    extra = [arena.robot.advance() for _ in range(4)]

    assert set(extra) <= {0, 1, 2}
    assert sum(extra) > 0


def test_a_period_that_is_no_multiple_of_the_step_is_refused(arena):
    """Webots would accept the period and never publish a message."""
    robot = Robotino(arena.webots, period_ms=50)

    with pytest.raises(WrongData, match="refuses a period of 50 ms"):
        robot.connect()

    robot.close()


def test_a_world_with_a_separate_supervisor_works_too(start):
    """Both robots need a step, because the world waits for every controller."""
    pair = start(world="two_robots", supervisor="supervisor", robot="robotino")
    pair.scene.reset(1, START, (1.0, 0.0))

    pair.robot.move(Movement.LEFT)
    for _ in range(5):
        pair.robot.advance()

    assert 0.4 < pair.robot.pose().y_m < 0.5


@pytest.mark.parametrize("ask", [Robotino.distances, Robotino.bumped])
def test_readings_are_asked_for_in_vain_before_the_first_period(arena, ask):
    """Without a reading, `False` would be a guess, and a TypeError would not explain the cause."""
    with pytest.raises(NoReading, match=r"call advance\(\) first"):
        ask(arena.robot)

    arena.robot.advance()
    ask(arena.robot)


def test_a_viewer_sees_where_it_is(arena):
    """To replay an episode, a viewer needs the scene once and the poses of every step."""
    scene = arena.webots.observer.scene()
    arena.scene.reset(1, START, (1.0, 0.5))

    state = arena.webots.observer.scene_state()

    (robot,) = (node for node in scene.nodes if node.robot)
    assert state.poses[robot.name][:2] == pytest.approx((START.x_m, START.y_m), abs=1e-4)
    assert state.poses["TARGET"][:2] == pytest.approx((1.0, 0.5))
    assert state.revision == scene.revision
