"""The world of a TurtleBot3 Burger: its robot, and the same obstacles as in the fake environment."""

import pytest

from palaestra_sim.world import Node, RunIdentity, WorldRobot, builtin, generate, parse, robots
from palaestra_trainer.testing.fake_burger import COURT

WORLD = parse(builtin("court"))


def defined(name: str) -> Node:
    """Return the node with a DEF name."""
    (node,) = [node for node in WORLD.walk() if node.def_name == name]
    return node


def test_the_court_has_one_robot_that_is_its_own_supervisor() -> None:
    """The robot is an instance of a PROTO of Webots, and the stub has a description of this PROTO."""
    assert defined("BURGER").type_name == "TurtleBot3Burger"
    assert robots(builtin("court")) == (
        WorldRobot(robot="burger", ros_name="burger", supervisor=True, synchronize=True, definition="BURGER"),
    )


def test_simulators_can_be_made_of_it(identity: RunIdentity) -> None:
    """The world refers to one other file, which every installation of Webots has."""
    made = generate(builtin("court"), identity, clock=True)

    assert generate(made, identity, clock=True) == made
    assert [extern.text.startswith(b'"webots://') for extern in WORLD.externs] == [True]


@pytest.mark.parametrize("thing", COURT.obstacles, ids=lambda thing: thing.name)
def test_the_fake_has_the_things_of_the_world(thing) -> None:
    """A policy that learned in the fake environment must find the same obstacles in this world."""
    node, shape = defined(thing.name), defined(f"{thing.name}_SHAPE")
    size = shape.numbers("size") or (0.0, 0.0, 0.3)

    assert node.numbers("translation") == (thing.x_m, thing.y_m, 0.15)
    assert (node.numbers("rotation") or (0, 0, 1, 0.0))[3] == thing.heading_rad
    assert (0.5 * size[0], 0.5 * size[1]) == thing.half_m
    assert (shape.numbers("radius") or (0.0,)) == (thing.radius_m,)
    assert (thing.bottom_m, thing.top_m) == (0.0, size[2])


def test_the_floor_is_that_of_the_fake() -> None:
    """A policy that learned with the fake must find a floor of the same size."""
    size = defined("FLOOR_SHAPE").numbers("size") or ()

    assert size[:2] == (2 * COURT.high[0], 2 * COURT.high[1])
    assert defined("WALL_0").numbers("translation") == (COURT.high[0] + 0.05, 0, 0.15)
