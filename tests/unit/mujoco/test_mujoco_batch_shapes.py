"""The objects on the floor that a batch describes to its trainer."""

import math

import pytest

from palaestra_sim.mujoco.batched.shapes import FLOOR, shapes_of
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics

HEAD = "#VRML_SIM R2023b utf8\n"


def shapes(text):
    """Return the shapes of a world with these nodes."""
    simulation = Simulation.load((HEAD + text).encode(), StubPhysics(), "world.wbt", Mode.FAST)
    return shapes_of(simulation)


def solid(outline, fields=""):
    """Return a Solid with a boundingObject."""
    return f"DEF THING Solid {{ {fields} boundingObject {outline} }}"


@pytest.mark.parametrize(
    ("outline", "half", "radius"),
    [
        ("Box { size 1 2 3 }", (0.5, 1.0, 1.5), 0.0),
        ("Cylinder { radius 0.5 height 2 }", (0.0, 0.0, 1.0), 0.5),
        ("Capsule { radius 0.5 height 2 }", (0.0, 0.0, 1.5), 0.5),
        ("Sphere { radius 0.5 }", (0.0, 0.0, 0.5), 0.5),
        ("Shape { geometry Box { size 1 2 3 } }", (0.5, 1.0, 1.5), 0.0),
    ],
)
def test_a_shape_has_its_half_size_or_its_radius(outline, half, radius) -> None:
    """The ends of a capsule lie beyond its height."""
    [found] = shapes(solid(outline, "translation 1 2 3"))

    assert (found.name, found.x, found.y, found.z) == ("THING", 1.0, 2.0, 3.0)
    assert (found.half_x, found.half_y, found.half_z) == half
    assert found.radius == radius


def test_the_parts_of_a_group_have_their_own_centers() -> None:
    """A table has a plate and legs in one boundingObject."""
    plate = "Pose { translation 0 0 1 children [ Box { size 2 2 0.1 } ] }"
    leg = (
        "Transform { translation 1 0 0 children Pose { translation 0 1 0.5 children Sphere { radius 0.1 } } }"
    )

    found = shapes(solid(f"Group {{ children [ {plate} {leg} ] }}"))

    centers = [(each.center_x, each.center_y, each.center_z) for each in found]
    assert centers == [(0.0, 0.0, 1.0), (1.0, 1.0, 0.5)]


@pytest.mark.parametrize(
    ("outline", "fields", "half", "radius"),
    [
        ("Pose { rotation 0 0 1 1.5707963 children Box { size 1 2 3 } }", "", (1.0, 0.5, 1.5), 0.0),
        ("Transform { scale 2 3 1 children Box { size 1 2 3 } }", "", (1.0, 3.0, 1.5), 0.0),
        ("Pose { rotation 1 0 0 1.5707963 children Cylinder { radius 0.5 height 2 } }", "", (0.5, 1, 0.5), 0),
        ("Cylinder { radius 0.5 height 2 }", "rotation 1 0 0 1.5707963", (0.5, 1.0, 0.5), 0.0),
        ("Cylinder { radius 0.5 height 2 }", "rotation 1 0 0 3.1415926535", (0.0, 0.0, 1.0), 0.5),
        ("Capsule { radius 0.5 height 2 }", "rotation 0 1 0 1.5707963", (1.5, 0.5, 0.5), 0.0),
        ("Sphere { radius 0.5 }", "rotation 0 1 0 1", (0.0, 0.0, 0.5), 0.5),
        ("Box { size 1 2 3 }", "rotation 0 1 0 1.5707963", (1.5, 1.0, 0.5), 0.0),
    ],
)
def test_a_turned_or_scaled_shape_has_its_extent_in_the_object(outline, fields, half, radius) -> None:
    """A barrel lies, and a wall is turned inside its Solid; a start must not be drawn inside of them."""
    [found] = shapes(solid(outline, fields))

    assert (found.half_x, found.half_y, found.half_z) == pytest.approx(half, abs=1e-6)
    assert found.radius == radius


@pytest.mark.parametrize(
    ("outline", "heading_rad"),
    [
        ("Box { }", 0.5),
        ("Cylinder { }", 0.0),
        ("Pose { translation 1 0 0 children Cylinder { } }", 0.5),
    ],
)
def test_a_heading_is_that_of_the_outline(outline, heading_rad) -> None:
    """A cylinder looks the same from each side, so a rotation about its own axis gives no heading."""
    [found] = shapes(solid(outline, "rotation 0 0 1 0.5"))

    assert found.heading_rad == pytest.approx(heading_rad)
    assert math.isfinite(found.heading_rad)


def test_a_shape_that_is_no_box_or_cylinder_is_left_out() -> None:
    """The trainer's reader over ROS does not find a plane either."""
    assert shapes(solid("Plane { }")) == ()


@pytest.mark.parametrize(
    ("node", "half"), [("RectangleArena { floorSize 4 2 }", (2.0, 1.0)), ("Floor { size 6 8 }", (3.0, 4.0))]
)
def test_a_floor_has_its_size(tmp_path, node, half) -> None:
    """A task samples its targets inside the floor."""
    path = tmp_path / "world.wbt"
    kind = node.partition(" ")[0]
    path.write_text(
        f'#VRML_SIM R2023b utf8\nEXTERNPROTO "webots://projects/objects/floors/protos/{kind}.proto"\n{node}\n'
    )
    simulation = Loader(physics=StubPhysics)(path, Mode.FAST)

    [found] = [each for each in shapes_of(simulation) if each.name == FLOOR]

    assert (found.half_x, found.half_y, found.heading_rad) == (*half, 0.0)
