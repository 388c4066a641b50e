"""A field has the type that Webots documents, or the type that its value in the world file shows."""

import pytest

from palaestra_sim.scene.nodes.types import BASE_TYPES, type_number
from palaestra_sim.scene.tree.field_types import FieldType, field_kinds, kinds_of
from palaestra_sim.world import builtin
from tests.scenes import load_scene
from tests.tables import for_each


@pytest.mark.parametrize(
    ("path", "number", "type_name", "count"),
    [
        ("TARGET.translation", 5, "SFVec3f", -1),
        ("TARGET.rotation", 6, "SFRotation", -1),
        ("TARGET.children", 0x19, "MFNode", 1),
        ("ROBOTINO.customData", 8, "SFString", -1),
        ("ROBOTINO.controllerArgs", 0x18, "MFString", 3),
        ("ROBOTINO.supervisor", 1, "SFBool", -1),
        ("ROBOTINO.physics", 9, "SFNode", -1),
        ("ROBOTINO.battery", 0x13, "MFFloat", 0),
        ("FLOOR_BOX.size", 5, "SFVec3f", -1),
        ("BODY.radius", 3, "SFFloat", -1),
        ("BODY.subdivision", 2, "SFInt32", -1),
    ],
)
def test_a_field_tells_its_type(robot, field, path, number, type_name, count):
    """As in Webots, the number of an MF type has 0x10 added, and the count of an SF field is -1."""
    def_name, name = path.split(".")
    handle = field(def_name, name)

    assert robot.get("supervisor/field/get_name", field=handle) == name
    assert robot.get("supervisor/field/get_type", field=handle) == number
    assert robot.get("supervisor/field/get_type_name", field=handle) == type_name
    assert robot.get("supervisor/field/get_count", field=handle) == count


@pytest.mark.parametrize(
    ("type_name", "number"),
    [("Robot", 34), ("Solid", 80), ("WorldInfo", 84), ("TouchSensor", 60), ("Nonsense", 0), ("-", 0)],
)
def test_type_numbers_are_those_of_nodes_h(type_name, number):
    """The numbers count from WB_NODE_NO_NODE = 0 in webots/nodes.h."""
    assert type_number(type_name) == number


def test_a_kind_of_robot_is_a_kind_of_solid():
    """The fields of a Robot begin with those of a Solid; a default of its own replaces the inherited one."""
    solid, robot = list(field_kinds("Solid")), list(field_kinds("Robot"))

    assert robot[: len(solid)] == solid
    assert field_kinds("Robot")["name"].default == "robot"
    assert field_kinds("Nonsense") == {}


NEW = {"Microphone", "Radio"}  # Webots' manual does not describe these types


@for_each("type_name", sorted(BASE_TYPES - NEW))
def test_every_base_type_has_its_fields(type_name):
    """In Webots every field exists, also one that the file does not set, and no type is a guess."""
    assert field_kinds(type_name)


def test_a_field_that_the_file_does_not_set_has_its_default(world):
    """A program that reads the radius of a `Sphere { }` gets 1, as in Webots."""
    simulation = load_scene(
        world("""Solid { boundingObject DEF BALL Sphere { } children [ Shape { geometry IndexedFaceSet {
          coord DEF CORNERS Coordinate { point [ 1 2 3, 4 5 6 ] } } } ] }""")
    )
    tree = simulation.tree
    radius = tree.field_of(tree.of_def("BALL"), "radius", simulation)
    points = tree.field_of(tree.of_def("CORNERS"), "point", simulation)

    assert (radius.get(FieldType.FLOAT), radius.kind.name) == (1.0, "SFFloat")
    assert (points.kind.name, points.count) == ("MFVec3f", 2)
    assert points.get(FieldType.VEC3F, 1) == (4.0, 5.0, 6.0)


@pytest.mark.parametrize(
    ("written", "kind"),
    [
        ("1", "SFFloat"),
        ("1 2", "SFVec2f"),
        ("1 2 3", "SFVec3f"),
        ("0 0 1 2", "SFRotation"),
        ("[ 1 2 3 ]", "MFFloat"),
        ('"text"', "SFString"),
        ('[ "text" ]', "MFString"),
        ("TRUE", "SFBool"),
        ("NULL", "SFNode"),
        ("[ Box { } ]", "MFNode"),
        ("[ ]", "MFNode"),
        ("1 2 3 4 5 6", "MFFloat"),
    ],
)
def test_a_field_that_is_not_listed_has_the_type_that_its_value_shows(world, written, kind):
    """A client can read a rare or a new field of Webots that the tables do not list."""
    simulation = load_scene(world(f"DEF A Pose {{ novelty {written} }}"))
    tree = simulation.tree

    assert tree.field_of(tree.of_def("A"), "novelty", simulation).kind.name == kind


def test_every_field_of_the_shipped_worlds_has_values():
    """A malformed default or a lost value of the built-in worlds would raise an error here."""
    for name in ("arena", "two_robots"):
        simulation = load_scene(builtin(name))
        for node in list(simulation.tree.nodes.values()):
            for field_name, kind in kinds_of(node).items():
                found = simulation.tree.field_of(node, field_name, simulation)
                if not kind.multiple:
                    found.get(FieldType(kind.type))
                assert found.count >= -1
