"""The fake robot: it passes the conformance suite, has simple physics, and dies at chosen steps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.errors import SimulatorDead
from palaestra_trainer.robots import Movement, Pose
from palaestra_trainer.robots.base import RADIUS_M, SENSOR_RANGE_M, RobotinoAbc
from palaestra_trainer.testing import (
    FakeRobotino,
    FakeSeeingRobotino,
    NotConforming,
    check_robot,
    check_scene,
    fake_arena,
    fake_pen,
    fake_seeing,
)
from palaestra_trainer.testing import conformance as rules


def test_the_fake_is_a_robotino():
    """Tests with the fake hold for other robots only if all pass the same conformance suite."""
    check_robot(FakeRobotino())


def test_the_fake_with_cameras_is_a_robotino():
    """The suite also checks the camera images."""
    check_robot(fake_seeing()[0])


def test_the_fake_e_puck_is_a_robot_with_a_scene():
    """The floor of the fake e-puck is smaller than that of other fakes, so the suite gets other poses."""
    robot, scene = fake_pen()

    check_robot(robot)
    check_scene(robot, scene, Pose(-0.3, 0.0, 1.0), (0.4, 0.0))


@pytest.mark.parametrize(
    ("pose", "sensor", "meters"),
    [
        (Pose(0.53, 0.1, 0.0), 0, 0.04 / math.cos(math.radians(17.1))),
        (Pose(0.0, 0.12, 0.0), 2, 0.25 - 0.06 - 0.12 - 0.031),
        (Pose(0.0, -0.12, 0.0), 5, 0.25 - 0.06 - 0.12 - 0.031),
    ],
    ids=["wall ahead", "cylinder to the left", "cylinder to the right"],
)
def test_each_infrared_sensor_of_the_fake_e_puck_looks_its_way(pose, sensor, meters):
    """The sensors look outward from the rim, in the order of their bearings."""
    robot, _ = fake_pen()

    robot.place(pose, seed=1)

    assert robot.distances()[sensor] == pytest.approx(meters, abs=0.004)
    assert robot.distances()[3] == pytest.approx(0.07, abs=0.004)  # no obstacle is behind the robot


def test_the_fake_has_a_scene():
    """A reset places the robot, and its seed determines everything that follows."""
    check_scene(*fake_arena(), Pose(0.2, -0.1, 1.0), (1.5, 1.5))


def test_it_slides_along_a_wall_and_says_so():
    """Only the velocity component toward the wall is lost."""
    robot, scene = fake_arena()
    scene.reset(0, Pose(1.7, 0.0, math.pi / 4), (0.0, 0.0))

    robot.move(Movement.FORWARD)
    for _ in range(3):
        robot.advance()

    assert robot.bumped()
    assert robot.pose().x_m == pytest.approx(2.0 - RADIUS_M)
    assert robot.pose().y_m > 0.15


def test_a_bump_is_over_once_the_robot_is_free():
    """The bumper reports contacts of the last step only."""
    robot, scene = fake_arena()
    scene.reset(0, Pose(1.72, 0.0, 0.0), (0.0, 0.0))
    robot.move(Movement.FORWARD)
    robot.advance()
    bumped = robot.bumped()

    robot.move(Movement.BACKWARD)
    robot.advance()
    robot.advance()

    assert bumped
    assert not robot.bumped()


def test_speeding_up_takes_time():
    """As in the simulators, the acceleration is limited, so the first period covers less distance."""
    robot = FakeRobotino()
    robot.move(Movement.FORWARD)

    robot.advance()
    first = robot.pose().x_m
    robot.advance()
    second = robot.pose().x_m - first

    assert 0.5 * second < first < second == pytest.approx(0.5 * robot.period_s)


def test_infrared_measures_from_the_body_to_the_wall():
    """Distances count from the body, not from the robot's center.

    No object is near the left sensor, so it returns its maximum.
    """
    robot, scene = fake_arena()

    scene.reset(0, Pose(2.0 - RADIUS_M - 0.2, 0.0, 0.0), (0.0, 0.0))

    assert robot.distances()[0] == pytest.approx(0.2, rel=0.03)
    assert robot.distances()[2] == pytest.approx(SENSOR_RANGE_M[1])


def test_infrared_sees_a_cylinder_on_the_left_with_the_sensors_on_the_left():
    """Sensors count counterclockwise from the front: the third of nine looks 80 degrees to the left."""
    robot, scene = fake_arena()

    scene.reset(0, Pose(0.8, 0.25, math.radians(10.0)), (0.0, 0.0))

    assert np.argmin(robot.distances()) == 2


@given(
    seed=st.integers(0, 2**31 - 1),
    moves=st.lists(st.sampled_from(Movement), min_size=1, max_size=60),
    heading_rad=st.floats(-math.pi, math.pi, exclude_min=True),
)
def test_it_never_leaves_the_floor_and_its_readings_never_leave_their_range(seed, moves, heading_rad):
    """A policy must not learn from poses that no real robot can have."""
    robot, scene = fake_arena()
    scene.reset(seed, Pose(0.0, 0.0, heading_rad), (0.0, 0.0))

    for move in moves:
        robot.move(move)
        robot.advance()
        pose, distances = robot.pose(), robot.distances()

        assert scene.layout().gap(pose.x_m, pose.y_m) >= RADIUS_M - 1e-6
        assert -math.pi < pose.heading_rad <= math.pi
        assert distances.min() >= np.float32(SENSOR_RANGE_M[0])
        assert distances.max() <= np.float32(SENSOR_RANGE_M[1])


def test_it_dies_at_the_steps_that_are_named():
    """A training test sets the steps at which its simulator dies; the count continues after a restart."""
    robot, _ = fake_arena(deaths=(2, 3))
    robot.advance()

    with pytest.raises(SimulatorDead, match="died at step 2; restart it"):
        robot.advance()
    robot.restart()
    with pytest.raises(SimulatorDead, match="died at step 3"):
        robot.advance()
    robot.restart()

    assert robot.advance() == 0


def test_the_dead_answer_nothing_until_they_are_restarted():
    """As with a real simulator, every call of a dead simulator raises the fault until its restart."""
    robot, scene = fake_arena(deaths=(1,))
    with pytest.raises(SimulatorDead):
        robot.advance()

    for call in (robot.distances, robot.pose, robot.bumped, robot.advance):
        with pytest.raises(SimulatorDead):
            call()
    with pytest.raises(SimulatorDead):
        scene.reset(0, Pose(0.0, 0.0, 0.0), (0.0, 0.0))
    robot.restart()
    scene.reset(0, Pose(1.0, 0.0, 0.0), (0.0, 0.0))

    assert robot.pose() == Pose(1.0, 0.0, 0.0)


OWN_ARRAY = np.full(9, 0.3, np.float32)


class _Flawed(FakeSeeingRobotino):
    """A fake robot with one method that breaks a rule."""

    def __init__(self, method: str, answer) -> None:
        super().__init__()
        setattr(self, method, lambda *_: answer(super(_Flawed, self)))


def _backwards(robot: RobotinoAbc) -> Pose:
    pose = robot.pose()
    return Pose(-pose.x_m, pose.y_m, pose.heading_rad)


@pytest.mark.parametrize(
    ("method", "answer", "rule"),
    [
        ("distances", lambda _: np.zeros(9, np.float32), rules.DISTANCES_ARE_METRES),
        ("distances", lambda _: np.full(8, 0.3, np.float32), rules.DISTANCES_HAVE_SHAPE),
        ("distances", lambda it: it.distances().astype(np.float64), rules.DISTANCES_HAVE_SHAPE),
        ("distances", lambda _: OWN_ARRAY, rules.DISTANCES_ARE_OWN),
        ("bumped", lambda _: 0.0, rules.BUMPED_IS_BOOL),
        ("pose", lambda _: Pose(0.0, 0.0, 4.0), rules.POSE_IS_FINITE),
        ("pose", lambda _: Pose(math.nan, 0.0, 0.0), rules.POSE_IS_FINITE),
        ("pose", lambda _: Pose(0.0, 0.0, 0.0), rules.MOVEMENTS_MOVE),
        ("pose", _backwards, rules.MOVEMENTS_MOVE),
        ("advance", lambda it: it.advance() or None, rules.ADVANCE_COUNTS),
        ("color_image", lambda _: np.zeros(3, np.uint8), rules.COLORS_ARE_TYPED),
        ("color_image", lambda it: it.color_image()[..., :1], rules.COLORS_ARE_TYPED),
        ("depth_image", lambda it: it.depth_image().astype(np.float64), rules.DEPTHS_ARE_TYPED),
        ("depth_image", lambda it: -it.depth_image(), rules.DEPTHS_ARE_TYPED),
    ],
    ids=[
        "out of range",
        "eight sensors",
        "float64",
        "the robot's own array",
        "bumped as a number",
        "heading beyond pi",
        "nowhere",
        "stuck",
        "mirrored",
        "no count of extra periods",
        "a flat image",
        "a gray image",
        "depths in float64",
        "negative depths",
    ],
)
def test_conformance_names_the_rule_that_a_robot_breaks(method, answer, rule):
    """If a check never failed for any robot, it would prove nothing."""
    with pytest.raises(NotConforming) as caught:
        check_robot(_Flawed(method, answer))

    assert str(caught.value).startswith(rule)


def test_conformance_sees_a_robot_that_rolls_on():
    """A robot that ignores STOP would drive past its target."""

    class Rolling(FakeRobotino):
        def drive(self, vx: float, vy: float, omega: float) -> None:
            if (vx, vy, omega) != Movement.STOP.twist:
                super().drive(vx, vy, omega)

    with pytest.raises(NotConforming) as caught:
        check_robot(Rolling())

    assert str(caught.value).startswith((rules.STOP_STOPS, rules.MOVEMENTS_MOVE))


def test_conformance_sees_readings_that_change_between_steps():
    """An environment reads the pose several times per step, and needs the same value each time."""

    class Restless(FakeRobotino):
        def pose(self) -> Pose:
            self._x_m += 1e-3
            return super().pose()

    with pytest.raises(NotConforming) as caught:
        check_robot(Restless())

    assert str(caught.value).startswith(rules.READINGS_STAND_STILL)


def test_conformance_sees_a_scene_that_leaves_the_robot_where_it_was():
    """Without a placed robot, an episode would begin where the last one ended."""

    class Idle:
        def reset(self, seed: int, start: Pose, target: tuple[float, float]) -> None:
            pass

    with pytest.raises(NotConforming) as caught:
        check_scene(FakeRobotino(), Idle(), Pose(0.5, 0.0, 0.0), (0.0, 0.0))

    assert str(caught.value).startswith(rules.RESET_PLACES)


def test_conformance_sees_chance_that_no_seed_decides():
    """Without determinism, no evaluation could be repeated."""
    robot = FakeRobotino()

    class Careless:
        rolls = 0

        def reset(self, seed: int, start: Pose, target: tuple[float, float]) -> None:
            self.rolls += 1
            self.target = target
            robot.place(start, seed + self.rolls)

    near_a_wall = Pose(1.5, 0.0, 0.0)
    with pytest.raises(NotConforming) as caught:
        check_scene(robot, Careless(), near_a_wall, (0.0, 0.0))

    assert str(caught.value).startswith(rules.RESET_DECIDES)
