"""The visible part of a world: shapes, colors, and the frames to which they belong."""

import math

import pytest

from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.meshes import cut
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.scene.visuals import View
from palaestra_sim.stub.physics import StubPhysics

RED = "appearance PBRAppearance { baseColor 1 0 0 }"


@pytest.fixture
def view(tmp_path):
    """`view(nodes)` returns the visible part of a world with these nodes."""

    def read(nodes, head="#VRML_SIM R2023b utf8\nWorldInfo { }"):
        path = tmp_path / "world.wbt"
        path.write_text(f"{head}\n{nodes}\n")
        leave_out = LeaveOut(types=frozenset(("WorldInfo",)))
        simulation = Loader(physics=StubPhysics, leave_out=leave_out)(path, Mode.FAST)
        return View(simulation.tree.root)

    return read


@pytest.fixture
def things(view):
    """`things(nodes)` returns the visible shapes of a world with these nodes."""
    return lambda *texts: view(*texts).things()


@pytest.mark.parametrize(
    ("geometry", "kind", "size"),
    [
        ("Box { size 1 2 3 }", "box", (1.0, 2.0, 3.0)),
        ("Box { }", "box", (0.1, 0.1, 0.1)),
        ("Sphere { radius 0.5 }", "ball", (1.0, 1.0, 1.0)),
        ("Cylinder { radius 0.5 height 3 }", "cylinder", (1.0, 1.0, 3.0)),
        ("Capsule { radius 0.5 height 3 }", "capsule", (1.0, 1.0, 4.0)),
        ("Plane { size 2 3 }", "box", (2.0, 3.0, 0.002)),
        ("Cone { bottomRadius 0.5 height 2 }", "mesh", (1.0, 1.0, 1.0)),
    ],
)
def test_each_geometry_has_a_kind_and_a_size(things, geometry, kind, size):
    """Sizes are full lengths, as for collision shapes."""
    (thing,) = things(f"Shape {{ geometry {geometry} }}")

    assert (thing.kind, thing.size) == (kind, size)
    assert thing.color == (1.0, 1.0, 1.0, 1.0)


@pytest.mark.parametrize(
    ("appearance", "color"),
    [
        ("PBRAppearance { baseColor 0.1 0.2 0.3 transparency 0.25 }", (0.1, 0.2, 0.3, 0.75)),
        ('PBRAppearance { baseColorMap ImageTexture { url "a.png" } }', (0.7, 0.7, 0.7, 1.0)),
        ("Appearance { material Material { diffuseColor 0.1 0.2 0.3 } }", (0.1, 0.2, 0.3, 1.0)),
        ("Appearance { material Material { } }", (0.8, 0.8, 0.8, 1.0)),
        ("Appearance { texture ImageTexture { } }", (0.7, 0.7, 0.7, 1.0)),
        ("Appearance { }", (1.0, 1.0, 1.0, 1.0)),
        ("PBRAppearance { baseColor 7 -1 0 }", (1.0, 0.0, 0.0, 1.0)),
        ("PBRAppearance { baseColor 1 1 }", (1.0, 1.0, 1.0, 1.0)),
    ],
)
def test_each_appearance_is_one_color(things, appearance, color):
    """Textures have no effect, and a color with wrong numbers still gives a color."""
    (thing,) = things(f"Shape {{ appearance {appearance} geometry Box {{ }} }}")

    assert thing.color == color


@pytest.mark.parametrize(
    "shape",
    [
        "Shape { }",
        "Shape { geometry Box { size 0 1 1 } }",
        "Shape { geometry Box { size 1 1 -1 } }",
        'Shape { geometry Mesh { url "a.stl" } }',
        "Shape { geometry IndexedFaceSet { } }",
        "Shape { geometry ElevationGrid { xDimension 2 yDimension 2 height [ 0 0 ] } }",
        "Shape { appearance PBRAppearance { transparency 1 } geometry Box { } }",
    ],
)
def test_what_has_no_surface_is_not_drawn(things, shape):
    """A world with a shape that cannot be rendered still loads."""
    assert things(shape) == ()


def test_a_shape_is_in_the_frame_of_the_nearest_place(things):
    """The Pose is a frame, but the Group inside it is not."""
    (thing,) = things(
        f"Solid {{ translation 1 2 3 children [ Pose {{ translation 0 0 1 children [ "
        f"Group {{ children [ Shape {{ {RED} geometry Box {{ }} }} ] }} ] }} ] }}"
    )

    assert thing.place.world_pose.after(thing.local).position == (1.0, 2.0, 4.0)


def test_a_scale_makes_a_shape_larger_and_moves_it_away(things):
    """An equal scale on all axes applies to the frame; an unequal scale changes only the shape."""
    even, uneven = things(
        "Transform { scale 2 2 2 children [ Transform { translation 1 0 0 children [ "
        "Shape { geometry Box { size 1 1 1 } } ] } ] }\n"
        "Transform { scale 1 2 3 children [ Shape { geometry Sphere { radius 0.5 } } ] }"
    )

    assert even.size == (2.0, 2.0, 2.0)
    assert even.place.world_pose.after(even.local).position == (2.0, 0.0, 0.0)
    assert uneven.size == (1.0, 2.0, 3.0)


def test_a_stand_in_has_the_shapes_of_its_outline(things):
    """A stand-in has a default color unless the world sets its appearance.

    The floor of an arena is darker than its walls.
    """
    arena = things("RectangleArena { }")
    (box,) = things(f"SolidBox {{ {RED} }}")

    assert len({thing.color for thing in arena}) == 2
    assert box.color == (1.0, 0.0, 0.0, 1.0)
    assert all(thing.node.stand_in for thing in (*arena, box))


def test_shapes_of_joints_and_of_robots_move_with_them(things):
    """A camera needs the frame that carries each shape; the floor outside all Solids has no frame."""
    body, wheel, floor = things(
        """Robot { name "r" boundingObject Box { } children [ Shape { geometry Box { } }
          HingeJoint { device RotationalMotor { } endPoint Solid {
            children [ Shape { geometry Cylinder { } } ] } } ] }
        Shape { geometry Plane { } }"""
    )

    assert body.place.moves
    assert wheel.place.moves
    assert floor.place is None


def test_a_mesh_of_points_has_triangles(things):
    """A face with more than three corners is cut into triangles; a face with an invalid index is left out."""
    (thing,) = things(
        """Shape { geometry IndexedFaceSet {
          coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0, 0 1 0 ] }
          coordIndex [ 0 1 2 3 -1 0 1 9 -1 0 1 ] } }"""
    )

    assert thing.mesh.triangles == ((0, 1, 2), (0, 2, 3))
    assert thing.mesh.points[2] == (1.0, 1.0, 0.0)


def test_a_mesh_that_is_seen_from_behind_is_turned_around(things):
    """With `ccw FALSE` the corners of the faces are listed clockwise, so the order is reversed."""
    (thing,) = things(
        """Shape { geometry IndexedFaceSet { ccw FALSE
          coord Coordinate { point [ 0 0 0, 1 0 0, 1 1 0 ] } coordIndex [ 0 1 2 ] } }"""
    )

    assert thing.mesh.triangles == ((0, 2, 1),)


HOOK = [(0, 0, 0), (2, 0, 0), (2, 1, 0), (1, 1, 0), (1, 2, 0), (0, 2, 0)]  # its area is 3 square meters


@pytest.mark.parametrize("first", [0, 1, 2])  # index of the first corner
@pytest.mark.parametrize("way", [1, -1])
def test_a_face_that_is_not_convex_is_cut_without_overlap(first, way):
    """The floor of a house is often such a face."""
    points = [(*point[first:], *point[:first]) for point in HOOK]
    triangles = cut(points, list(range(6))[::way])

    areas = [area(*(points[index] for index in triangle)) for triangle in triangles]
    assert len(triangles) == 4
    assert sum(areas) == pytest.approx(3.0)


def test_an_outline_that_crosses_itself_ends():
    """No triangulation of such an outline is right, but the function must return."""
    star = [(0, 0, 0), (2, 2, 0), (0, 2, 0), (2, 0, 0), (1, 3, 0)]

    assert len(cut(star, [0, 1, 2, 3, 4])) == 3


def area(a, b, c):
    """Return the area of a triangle."""
    across, along = ([q - p for p, q in zip(a, corner, strict=True)] for corner in (b, c))
    normal = [across[i - 2] * along[i - 1] - across[i - 1] * along[i - 2] for i in range(3)]
    return math.hypot(*normal) / 2


def test_a_grid_of_heights_is_a_mesh(things):
    """Heights are listed row by row, with x changing first."""
    (thing,) = things(
        "Shape { geometry ElevationGrid { xDimension 2 yDimension 2 xSpacing 3 height [ 0 0.5 1 2 ] } }"
    )

    assert thing.mesh.points == ((0.0, 0.0, 0.0), (3.0, 0.0, 0.5), (0.0, 1.0, 1.0), (3.0, 1.0, 2.0))
    assert len(thing.mesh.triangles) == 2


def test_a_cylinder_of_an_old_file_stands_along_y(things):
    """In a file of R2021b the axis of a cylinder is y, and Webots also turns it to z."""
    world = """Solid { children [ Shape { geometry Cylinder { } } ] }"""
    (thing,) = things(world, "#VRML_SIM R2021b utf8\nWorldInfo { }")

    assert abs(thing.local.rotation[7]) == pytest.approx(1.0)


@pytest.mark.parametrize(
    ("background", "sky"),
    [
        ("", (0.0, 0.0, 0.0)),
        ("Background { skyColor 0.1 0.2 0.3 }", (0.1, 0.2, 0.3)),
        ("TexturedBackground { }", (0.62, 0.76, 0.92)),
    ],
)
def test_the_sky_has_one_color(view, background, sky):
    """A world without a background has a black sky, as in Webots."""
    assert view(background).sky() == sky


def test_writes_that_are_visible_are_counted(view):
    """A renderer reads the nodes again only after a visible write; a write of `name` is not visible."""
    seen = view(f'Solid {{ name "s" children [ Shape {{ {RED} geometry Box {{ }} }} ] }}')
    solid = seen.root.nodes()[1]
    look = solid.nodes()[0].nodes("appearance")[0]

    seen.written(solid, "translation")
    seen.written(look, "baseColor")
    seen.written(solid, "name")

    assert (seen.moves, seen.changes) == (1, 1)
    assert math.isclose(look.numbers("baseColor")[0], 1.0)
