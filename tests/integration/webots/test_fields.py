"""The supervisor reads and writes fields and velocities as Python values."""

import math

import numpy as np
import pytest

from palaestra_trainer.errors import ConfigurationError, WrongData
from palaestra_trainer.robots import Pose

START = Pose(-1.5, 0.0, 0.0)


@pytest.mark.parametrize(
    ("node", "field", "value"),
    [
        ("TARGET", "translation", (0.5, -0.25, 0.001)),
        ("TARGET", "rotation", (0.0, 0.0, 1.0, 0.5)),
        ("CYLINDER_0", "translation", (1.0, 0.5, 0.2)),
        ("ROBOTINO", "customData", '{"seed": 3}'),
    ],
)
def test_what_is_written_is_read_as_the_same_type(arena, node, field, value):
    """A user passes only the names and the value, and the supervisor finds handle, type and service."""
    arena.scene.supervisor.set_field(node, field, value)

    found = arena.scene.supervisor.get_field(node, field)

    assert type(found) is type(value)
    assert found == (value if isinstance(value, str) else pytest.approx(value))


@pytest.mark.parametrize(
    ("node", "field", "value"),
    [
        ("ROBOTINO", "supervisor", True),
        ("BODY", "subdivision", 36),
        ("BODY", "radius", 0.2266),
        ("ROBOTINO", "name", "robotino"),
        ("TARGET", "rotation", (0.0, 0.0, 1.0, 0.0)),
    ],
)
def test_a_field_is_read_as_the_type_that_it_has(arena, node, field, value):
    """The simulator reports the type, so an integer is not read as a float."""
    found = arena.scene.supervisor.get_field(node, field)

    assert (type(found), found) == (type(value), value)


def test_one_of_several_values_is_chosen_by_its_index(arena):
    """The field controllerArgs has several values, so a user needs an index."""
    assert arena.scene.supervisor.get_field("ROBOTINO", "controllerArgs", 1) == "--synchronize"


@pytest.mark.parametrize(
    ("node", "field", "value", "fact"),
    [
        ("TARGET", "translation", (0.5, 0.5), r"TARGET.translation: \(0.5, 0.5\) does not fit; give x, y, z"),
        ("TARGET", "translation", 1.0, "TARGET.translation: 1.0 does not fit; give x, y, z"),
        ("TARGET", "translation", (0.5, 0.5, math.nan), "TARGET.translation: .* does not fit; give x, y, z"),
        (
            "TARGET",
            "rotation",
            (0.0, 0.0, 0.0, 1.0),
            "TARGET.rotation: .* does not fit; give x, y, z of an axis and an angle",
        ),
        ("ROBOTINO", "customData", 3, "ROBOTINO.customData: 3 does not fit; give text"),
        ("BODY", "radius", True, "BODY.radius: True does not fit; give a finite number"),
        ("TARGET", "children", "x", "TARGET.children: holds nodes, not values"),
    ],
)
def test_a_value_that_a_field_cannot_hold_is_refused_before_it_is_sent(arena, node, field, value, fact):
    """Webots would ignore the value and report success."""
    with pytest.raises(ConfigurationError, match=fact):
        arena.scene.supervisor.set_field(node, field, value)


def test_numbers_of_numpy_are_numbers(arena):
    """NumPy's random generators return numbers of NumPy's types."""
    place = np.array([0.5, 0.25, 0.001])

    arena.scene.supervisor.set_field("TARGET", "translation", tuple(place))

    assert arena.scene.supervisor.get_field("TARGET", "translation") == (0.5, 0.25, 0.001)


def test_a_node_or_field_that_is_not_there_is_named(arena):
    """A request with the handle 0 would have no effect, so the error must name the missing node."""
    with pytest.raises(WrongData, match="the world has no node DEF NOTHING"):
        arena.scene.supervisor.get_field("NOTHING", "translation")
    with pytest.raises(WrongData, match="TARGET has no field color"):
        arena.scene.supervisor.get_field("TARGET", "color")


def test_a_cylinder_that_is_moved_by_field_is_met_where_it_is(arena):
    """Domain randomization moves obstacles, and the sensors must measure the new positions."""
    arena.scene.reset(1, START, (1.0, 0.0))
    free = arena.robot.distances()[0]

    arena.scene.supervisor.set_field("CYLINDER_0", "translation", (-0.9, 0.0, 0.2))
    arena.robot.advance()
    arena.robot.advance()

    assert free == pytest.approx(0.40, abs=0.01)
    assert arena.robot.distances()[0] == pytest.approx(0.6 - 0.2266 - 0.25, abs=0.02)


def test_a_velocity_that_is_given_is_had(arena):
    """A user must read the velocity that she has set.

    The units are meters and radians per second, in world axes.
    """
    arena.scene.reset(1, START, (1.0, 0.0))

    arena.scene.supervisor.set_velocity("ROBOTINO", (0.2, 0.0, 0.0), (0.0, 0.0, 0.5))

    linear, angular = arena.scene.supervisor.velocity("ROBOTINO")
    assert linear == pytest.approx((0.2, 0.0, 0.0))
    assert angular == pytest.approx((0.0, 0.0, 0.5))


def test_the_robot_knows_its_ros_name(arena):
    """A user needs the name for additional sensors and motors."""
    assert arena.robot.node_name == "robotino"
