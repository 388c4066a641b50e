"""Robots, rays and contacts behave alike under the stub and MuJoCo."""

import math
import random
import re

import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin

RADIUS_M = 0.2286  # the arena's Robotino with its bumper
WALL_M = 2.0
OTHER = b"""
Robot {
  translation 0.8 0 0.2
  name "other"
  controller "<none>"
  boundingObject Cylinder { radius 0.2 height 0.4 }
}
"""


def place(simulation, x, y, heading_rad=0.0):
    """Put the first robot at a pose, as a supervisor does."""
    robot = simulation.robots[0].place
    robot.translation = (x, y, robot.translation[2])
    robot.rotation = (0.0, 0.0, 1.0, heading_rad)


def distances(simulation):
    """Return the readings of the infra-red sensors, in volts."""
    return [it.value for name, it in simulation.robots[0].sensors.items() if name.startswith("ir")]


def test_a_robot_drives_as_it_is_commanded(load, drive):
    """In a second at 0.5 m/s, the robot drives half a meter, less the distance lost in the acceleration."""
    body = drive(load(), 0.25, 0.0, 0.0, steps=5)

    assert (body.x, body.y) == pytest.approx((0.25 * 0.96, 0.0), abs=0.02)
    assert body.velocity == pytest.approx((0.25, 0.0, 0.0), abs=0.005)


def test_a_robot_turns_as_it_is_commanded(load, drive):
    """The robot turns past pi, and its heading stays in (-pi, pi]."""
    body = drive(load(), 0.0, 0.0, 1.5, steps=13)

    assert body.heading_rad == pytest.approx(math.remainder(1.5 * 13 * 0.192, 2.0 * math.pi), abs=0.05)


def test_a_wall_holds_a_robot_and_its_bumper_feels_it(load, drive):
    """The robot stops at the wall with its wheels still turning, and the bumper reports the contact."""
    simulation = load()
    place(simulation, 1.5, 0.0)

    body = drive(simulation, 0.4, 0.0, 0.0, steps=10)
    simulation.step(192)

    assert body.x == pytest.approx(WALL_M - RADIUS_M, abs=0.01)
    assert simulation.robots[0].sensors["touch sensor"].value is True


def test_a_robot_slides_along_a_wall(load, drive):
    """The wall stops the motion toward it, but not the motion along it."""
    simulation = load()
    place(simulation, 1.7, -0.5)

    body = drive(simulation, 0.2, 0.2, 0.0, steps=10)

    assert body.x < WALL_M - RADIUS_M + 0.01
    assert body.y > -0.4


def test_sensors_see_walls_and_not_their_robot(load):
    """If the rays met their own robot, all sensors would read about the same.

    Here the sensor that faces the wall reads the highest voltage.
    """
    simulation = load()
    place(simulation, 1.6, 0.0)
    simulation.step(192)

    seen = distances(simulation)
    assert max(seen) == seen[0]
    assert len(set(seen)) > 3


def test_both_physics_see_alike():
    """A policy that was trained with one physics reads the same values with the other."""
    readings = []
    for physics in (StubPhysics, MujocoPhysics):
        simulation = Simulation.load(builtin("arena"), physics(), "arena", Mode.FAST)
        seen = []
        for x, y, heading in ((0.0, 0.0, 0.0), (1.5, 1.4, 0.7), (-1.2, 0.3, 2.0), (1.6, -1.6, -1.0)):
            place(simulation, x, y, heading)
            simulation.step(192)
            seen += distances(simulation)
        readings.append(seen)

    assert readings[0] == pytest.approx(readings[1], rel=0.02)


def test_an_obstacle_that_a_supervisor_moves_is_met_where_it_is(load, drive):
    """An environment moves obstacles at each episode, so rays and contacts must follow them."""
    simulation = load()
    node = simulation.tree.of_def("CYLINDER_0")
    translation = simulation.tree.field_of(node, "translation", simulation)
    translation.set(FieldType.VEC3F, 0, (0.7, 0.0, 0.2))

    body = drive(simulation, 0.4, 0.0, 0.0, steps=10)

    assert body.x == pytest.approx(0.7 - 0.25 - RADIUS_M, abs=0.02)


def test_an_obstacle_that_comes_out_of_the_floor_holds_a_robot(load, drive):
    """An environment hides its cylinders below the floor, and raises them when an episode needs them."""
    simulation = load(builtin("arena").replace(b"translation 0.8 0.8 0.2", b"translation 0.8 0.8 -0.7"))
    node = simulation.tree.of_def("CYLINDER_0")
    translation = simulation.tree.field_of(node, "translation", simulation)
    translation.set(FieldType.VEC3F, 0, (0.7, 0.0, 0.2))

    body = drive(simulation, 0.4, 0.0, 0.0, steps=10)

    assert body.x == pytest.approx(0.7 - 0.25 - RADIUS_M, abs=0.02)


def test_contact_points_name_both_sides(load, drive):
    """A supervisor reads from a contact point which wall the robot touches."""
    simulation = load()
    place(simulation, 1.7, 0.0)
    drive(simulation, 0.4, 0.0, 0.0, steps=5)

    wall = simulation.tree.of_def("WALL_0")
    points = simulation.contact_points(wall, descendants=False)

    assert points
    assert {number for _, number in points} == {wall.number}
    assert points[0][0][0] == pytest.approx(WALL_M, abs=0.01)


def test_a_push_fades(load, drive):
    """After a push, the motors return the robot to its commanded velocity."""
    simulation = load()
    body = simulation.robots[0].body
    body.push(0.5, 0.0, 0.0)

    assert body.velocity == (0.5, 0.0, 0.0)
    drive(simulation, 0.0, 0.0, 0.0)
    assert body.velocity == pytest.approx((0.0, 0.0, 0.0), abs=0.01)


def test_a_reset_forgets_everything(load, drive):
    """After a reset, the same commands give the same values as in a new simulation, bit for bit."""

    def course(simulation):
        trace = []
        for vx, omega in ((0.5, 0.0), (0.3, 1.2), (0.6, -0.5), (0.6, 0.0), (0.6, 0.0)):
            body = drive(simulation, vx, 0.1, omega, steps=3)
            trace.append((body.x, body.y, body.heading_rad, *distances(simulation)))
        return trace

    fresh, used = load(), load()
    drive(used, 0.6, -0.2, 0.9, steps=7)
    used.reset()
    used.advance(used.basic_step_ms)
    fresh.reset()
    fresh.advance(fresh.basic_step_ms)

    assert course(used) == course(fresh)


def test_an_imported_crate_is_an_obstacle_until_the_reset(load, drive):
    """The import must not change the state of the robot, and the reset must remove the crate."""
    simulation = load()
    drive(simulation, 0.2, 0.0, 0.0, steps=2)
    before = simulation.robots[0].place.translation
    crate = "Solid { translation 1 0 0.5 boundingObject Box { size 0.2 0.2 1 } }"
    children = simulation.tree.field_of(simulation.tree.root, "children", simulation)
    assert simulation.add(crate, children, -1)

    assert simulation.robots[0].place.translation == before
    assert drive(simulation, 0.4, 0.0, 0.0, steps=12).x == pytest.approx(0.9 - RADIUS_M, abs=0.02)
    simulation.reset()
    simulation.step(192)
    place(simulation, 0.0, 0.0)
    assert drive(simulation, 0.4, 0.0, 0.0, steps=12).x > 0.85


def test_robots_run_into_each_other(load, drive):
    """Each robot is an obstacle for the other robot and for the other robot's rays."""
    simulation = load(builtin("arena") + OTHER)

    body = drive(simulation, 0.3, 0.0, 0.0, steps=15)

    assert body.x == pytest.approx(0.8 - 0.2 - RADIUS_M, abs=0.05)
    assert max(distances(simulation)) == distances(simulation)[0]


def test_a_robot_inside_a_pose_stands_where_the_pose_puts_it(load, drive):
    """A robot inside a Pose has no body of its own, so it is a fixed obstacle."""
    simulation = load(builtin("arena") + b"Pose { translation 0.5 0 0 children [" + OTHER + b"] }")
    standing = simulation.scene.solids[-1].pose.position

    body = drive(simulation, 0.3, 0.0, 0.0, steps=25)

    assert standing == pytest.approx((1.3, 0.0, 0.2))
    assert body.x == pytest.approx(1.3 - 0.2 - RADIUS_M, abs=0.03)


@pytest.fixture
def free_pair():
    """Return two simulations of the arena without walls and cylinders: one of the stub, one of MuJoCo."""
    source = builtin("arena").decode()
    for name in ("WALL", "CYLINDER"):
        source = re.sub(rf"(DEF {name}_\d Solid \{{\s*translation )\S+ \S+ ", r"\g<1>90 90 ", source)
    return lambda: [Simulation.load(source.encode(), it(), "free") for it in (StubPhysics, MujocoPhysics)]


def test_mujoco_follows_the_stub_through_each_change_of_speed(drive, free_pair):
    """A policy that was trained with one of the two physics finds the same accelerations with the other."""
    pair = free_pair()
    for simulation in pair:
        place(simulation, 0.0, 0.0, 2.5)
    for command in ((0.5, 0, 0), (0.5, 0, 0), (0, 0.5, 0), (0, 0, 0), (0, 0, 1), (0, 0, 0), (-0.5, 0, 0)):
        here, there = (drive(simulation, *command) for simulation in pair)

        assert (here.x, here.y) == pytest.approx((there.x, there.y), abs=1e-3)
        assert here.heading_rad == pytest.approx(there.heading_rad, abs=1e-3)


def test_a_robot_that_was_held_back_does_not_jump(load, drive):
    """The servos compensate for their own delay.

    If they compensated for an obstacle too, the robot would jump when released.
    """
    simulation = load()
    place(simulation, 1.5, 0.0)
    drive(simulation, 0.4, 0.0, 0.0, steps=10)
    place(simulation, 0.0, 0.0)

    body = drive(simulation, 0.4, 0.0, 0.0, steps=1)

    assert body.x <= 0.4 * 0.192 + 1e-3


def test_mujoco_follows_the_stub_in_free_space(drive, free_pair):
    """Ten random drives of ten seconds end within 1 cm and half a degree of each other.

    Each drive has a new command every 192 ms.
    """
    for seed in range(10):
        draw = random.Random(seed)
        pair = free_pair()
        for _ in range(52):
            command = draw.uniform(-0.6, 0.6), draw.uniform(-0.6, 0.6), draw.uniform(-1.5, 1.5)
            here, there = (drive(simulation, *command) for simulation in pair)

        assert math.hypot(here.x - there.x, here.y - there.y) < 0.01
        turned = math.remainder(here.heading_rad - there.heading_rad, 2.0 * math.pi)
        assert abs(math.degrees(turned)) < 0.5
