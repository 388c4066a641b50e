"""Mesh files: the triangles of STL and OBJ files, and one sentence for a file that cannot be read."""

import errno
import os
import struct

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.mesh_files import MOST_BYTES, MOST_TRIANGLES, decode
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.scene.world_report import differences
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import parse
from tests.tables import for_each
from tests.values.worlds import PHYSICS, STEP_MS, Setting, device, enable, robot

CORNERS = [(0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 2.0, 0.0), (0.0, 0.0, 3.0)]
FACES = [(0, 2, 1), (0, 1, 3), (1, 2, 3), (2, 0, 3)]
NUMBERS = st.floats(-100.0, 100.0, width=32)
TRIANGLES = st.lists(st.tuples(*[st.tuples(NUMBERS, NUMBERS, NUMBERS)] * 3), min_size=1, max_size=20)
MESH = 'Mesh { url "pyramid.stl" }'
OUTLINE = 'Solid { boundingObject Mesh { url "%s" } }'


def binary(triangles, header=b"solid, but binary"):
    """Return a binary STL file."""
    body = b"".join(struct.pack("<12fH", 0, 0, 1, *(it for at in each for it in at), 0) for each in triangles)
    return header.ljust(80) + struct.pack("<I", len(triangles)) + body


def text(triangles):
    """Return an STL file as text."""
    lines = ["solid part"]
    for each in triangles:
        lines += ["facet normal 0 0 1", "outer loop"]
        lines += ["vertex {!r} {!r} {!r}".format(*corner) for corner in each]
        lines += ["endloop", "endfacet"]
    return "\n".join((*lines, "endsolid part")).encode()


def obj(points, faces):
    """Return an OBJ file."""
    lines = ["v {!r} {!r} {!r}".format(*point) for point in points]
    lines += [f"f {' '.join(str(at + 1) for at in face)}" for face in faces]
    return "\n".join(lines).encode()


PYRAMID = {"pyramid.stl": binary([tuple(CORNERS[at] for at in face) for face in FACES])}


def corners_of(mesh):
    """Return the corners of each triangle."""
    return [tuple(mesh.points[at] for at in triangle) for triangle in mesh.triangles]


@given(TRIANGLES)
def test_each_form_of_a_file_has_the_same_triangles(triangles):
    """Programs write STL in both forms, and the header of a binary file may begin with `solid` too."""
    points = [corner for each in triangles for corner in each]
    faces = [range(start, start + 3) for start in range(0, len(points), 3)]

    assert corners_of(decode(binary(triangles), "a.stl")) == triangles
    assert corners_of(decode(text(triangles), "a.STL")) == triangles
    assert corners_of(decode(obj(points, faces), "a.obj")) == triangles


@pytest.mark.parametrize("name", ["a.stl", "a.obj"])
def test_mujoco_reads_the_same_points(name):
    """MuJoCo's own reader is the oracle; it moves the points to the frame of the inertia."""
    triangles = [tuple(CORNERS[at] for at in face) for face in FACES]
    data = {"a.stl": binary(triangles), "a.obj": obj(CORNERS, FACES)}[name]
    xml = f"""<mujoco><asset><mesh name="m" file="{name}"/></asset>
      <worldbody><geom type="mesh" mesh="m"/></worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml, assets={name: data})
    turned = np.empty(9)
    mujoco.mju_quat2Mat(turned, model.mesh_quat[0])
    theirs = model.mesh_vert @ turned.reshape(3, 3).T + model.mesh_pos[0]

    ours = decode(data, name).points
    rows = sorted(map(tuple, np.round(theirs, 5) + 0.0))
    assert np.array(rows) == pytest.approx(np.array(sorted(ours)), abs=1e-5)


def test_a_face_of_an_obj_file_may_have_four_corners_and_count_backward():
    """OBJ files also have texture coordinates, normals, comments, lines that go on, and objects."""
    data = b"""# a square
mtllib a.mtl
o square
v 0 0 0 1.0
v 1 0 0
v 1 1 0
v 0 1 0
vt 0 0
vn 0 0 1
f 1/1/1 2/1/1 \\
3/1/1 4//1
f -4 -3 -2
"""
    mesh = decode(data, "square.obj")

    assert mesh.points == ((0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0))
    assert mesh.triangles == ((0, 1, 2), (0, 2, 3), (0, 1, 2))


ONE = [tuple(CORNERS[:3])]
WRONG = [
    ("a.dae", b"", "is neither an STL file nor an OBJ file; convert it to one of them"),
    ("a.stl", b"", "is not an STL file, or is cut off"),
    ("a.stl", binary(ONE)[:-1], "is not an STL file, or is cut off"),
    ("a.stl", text([]), "has no triangle"),
    ("a.stl", text(ONE).replace(b"vertex 1.0", b"vertex x"), "line 5 does not have three numbers"),
    ("a.stl", text(ONE).rpartition(b"vertex")[0], "has a triangle with too few corners; it may be cut off"),
    ("a.stl", binary([((0, 0, 0), (1, 0, 0), (0, float("nan"), 0))]), "has a corner that is not finite, or"),
    ("a.stl", binary([((0, 0, 0), (1, 0, 0), (0, 1e6, 0))]), "or farther than 100000 m away"),
    ("a.obj", b"v 1 2\n", "line 1 does not have three numbers"),
    ("a.obj", b"v 1 2 3\nf 1 1 2\n", "line 2 has a corner 2, but 1 points precede it"),
    ("a.obj", b"v 1 2 3\nf 1 0 1\n", "line 2 has a corner 0, but 1 points precede it"),
    ("a.obj", b"v 1 2 3\nf 1 x 1\n", "line 2 has a corner without a number"),
    ("a.obj", b"v 1 2 3\nf 1 1\n", "line 2 has a face with 2 corners; use triangles"),
    ("a.obj", b"v 1 2 3\nf" + b" 1" * 101, "line 2 has a face with 101 corners; use triangles"),
    ("a.obj", b"v 1 2 3\n" + b"f 1 1 1\n" * (MOST_TRIANGLES + 1), "has more than 100000 triangles; use a"),
]


@for_each("name, data, message", WRONG)
def test_a_wrong_file_is_refused_with_its_line_or_the_remedy(name, data, message):
    """The file is another person's, and may be large: one sentence must say what to change."""
    with pytest.raises(ValueError, match=message):
        decode(data, name)


def loaded(physics, address, read, leave_out=None):
    """Return the simulation of a world with one Mesh as a boundingObject."""
    world = parse(Setting(physics).text(OUTLINE % address).encode(), "my.wbt")
    descriptions = Descriptions(read=read)
    return Simulation.of(world, PHYSICS[physics](), "my.wbt", Mode.FAST, descriptions, leave_out)


def absent(_, address):
    """Raise the error of a missing file."""
    raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), address)


@pytest.mark.parametrize("physics", PHYSICS)
@pytest.mark.parametrize(
    ("address", "read", "fact"),
    [
        ("", absent, "the Mesh of a boundingObject: has no url"),
        ("https://x/a.stl", None, "the Mesh of a boundingObject: https://x/a.stl cannot be read here"),
        ("a.stl", absent, "the Mesh of a boundingObject: a.stl: No such file or directory"),
        ("a.stl", lambda *_: b"x", "the Mesh of a boundingObject: a.stl is not an STL file, or is cut off"),
        ("a.stl", lambda *_: binary([[(0, 0, 0)] * 3]), "all its triangles have the area 0"),
    ],
)
def test_a_mesh_that_cannot_be_read_is_refused_at_its_line_and_can_be_left_out(physics, address, read, fact):
    """Without its boundingObject, robots and rays would pass through the Solid without an error."""
    with pytest.raises(WorldError) as refused:
        loaded(physics, address, read)

    assert refused.value.line == 3
    assert fact in str(refused.value)
    left = loaded(physics, address, read, LeaveOut(types=frozenset(("Mesh",)))).left_out
    assert [fact in str(each) for each in left] == [True]


def test_a_file_that_many_nodes_name_is_read_once_and_may_be_turned_inside_out():
    """A hexapod has the same leg six times. `ccw FALSE` turns the triangles, and not the file.

    Both forms are kept, because each new one would build its bounding-box tree again.
    """
    read = []
    solid = 'Solid {{ boundingObject Mesh {{ url "leg.stl" ccw {} }} }} '
    solids = solid.format("TRUE") + solid.format("FALSE")
    files = {"leg.stl": binary([tuple(CORNERS[at] for at in face) for face in FACES])}
    world = parse(Setting("stub").text(solids).encode(), "my.wbt")
    descriptions = Descriptions(read=lambda _, address: (read.append(address), files[address])[1])
    simulation = Simulation.of(world, StubPhysics(), "my.wbt", Mode.FAST, descriptions)

    assert read == ["leg.stl"]
    first, second = (shape.mesh.triangles for shape in simulation.scene.solids)
    assert second == tuple((a, c, b) for a, b, c in first)
    turned = next(node for node in simulation.tree.root.descendants() if not node.flag("ccw", True))
    assert simulation.tree.mesh_files.mesh_of(turned) is simulation.tree.mesh_files.mesh_of(turned)


@pytest.mark.parametrize("physics", PHYSICS)
def test_the_center_of_mass_of_a_mesh_is_that_of_its_volume(physics):
    """With a density, the mass follows from the file; without it, the center would be the Solid's origin."""
    solid = f"DEF S Solid {{ physics Physics {{ density 1000 }} boundingObject {MESH} }}"
    simulation = Setting(physics).load(robot(solid), files=PYRAMID)

    found = simulation.motion.center_of_mass(simulation.tree.of_def("S"))

    assert found == pytest.approx((0.25, 0.5, 0.75))


@pytest.mark.parametrize("physics", PHYSICS)
def test_an_obstacle_keeps_its_mesh_if_a_client_resizes_another_part(physics):
    """Robots and rays would pass through the mesh until the simulator restarts."""
    solid = f"Solid {{ boundingObject Group {{ children [ DEF B Box {{ }} {MESH} ] }} }}"
    simulation = Setting(physics).load(solid, files=PYRAMID)
    size = simulation.tree.field_of(simulation.tree.of_def("B"), "size", simulation)

    size.set(FieldType.VEC3F, 0, (0.2, 0.3, 0.4))
    simulation.step(STEP_MS)

    assert [shape.kind for shape in simulation.scene.solids] == ["box", "mesh"]
    assert simulation.scene.solids[0].size == (0.2, 0.3, 0.4)


def test_a_mesh_hides_the_target_of_a_radar_with_occlusion():
    """A policy that sees through a wall drives into it."""
    target = "Solid { translation 3 0 0.5 boundingObject Sphere { radius 0.1 } radarCrossSection 2 }"
    radar = "Radar { translation 0 0 0.5 minRadialSpeed 0 maxRadialSpeed 0 occlusion TRUE }"
    seen = []
    for aside in (0.0, 5.0):
        wall = f"Solid {{ translation 1 {aside - 0.5} 0 boundingObject {MESH} }}"
        simulation = Setting("stub").load(wall + target + robot(radar), files=PYRAMID)
        enable(simulation)
        simulation.step(STEP_MS)
        seen.append(len(device(simulation, "radar").seen))

    assert seen == [0, 1]


def test_a_viewer_shows_a_robot_by_the_mesh_of_its_bounding_object():
    """A robot without visible shapes would be invisible, although it is simulated."""
    simulation = Setting("stub").load(robot("", f"boundingObject {MESH}"), files=PYRAMID)

    assert len(simulation.appearance.scene("my.wbt").meshes) == 1


def test_a_wrong_file_is_read_once_and_all_files_together_are_limited():
    """A picture must not read a wrong file again, and a thousand large files must not take all memory."""
    read = []
    shapes = 'Shape { geometry Mesh { url "a.stl" } } ' * 3 + 'Shape { geometry Mesh { url "b.stl" } }'
    files = {"a.stl": b"x" * 64, "b.stl": bytes(MOST_BYTES)}
    world = parse(Setting("stub").text(f"Solid {{ children [ {shapes} ] }}").encode(), "my.wbt")
    descriptions = Descriptions(read=lambda _, address: (read.append(address), files[address])[1])
    simulation = Simulation.of(world, StubPhysics(), "my.wbt", Mode.FAST, descriptions)

    assert [dict(simulation.unread_meshes) for _ in range(2)] == [{"Mesh": 4}] * 2
    assert read == ["a.stl", "b.stl"]
    meshes = [it for it in simulation.tree.root.descendants() if it.type_name == "Mesh"]
    with pytest.raises(ValueError, match=r"b\.stl and the mesh files before it have more than 64 MiB"):
        simulation.tree.mesh_files.mesh_of(meshes[-1])


def test_the_report_counts_the_meshes_that_no_sensor_sees():
    """A lidar that looks through a wall trains a policy to drive into it."""
    shape = "Solid {{ children [ {} ] }} "
    read, unread = 'Shape { geometry Mesh { url "a.stl" } } ', 'Shape { geometry Mesh { url "a.dae" } } '
    unknown = "Shape { geometry Text { } } "
    nodes = shape.format(read + 2 * unread + 'CadShape { url "a.obj" } ' + unknown)
    files = {"a.stl": binary(ONE), "a.dae": b"", "a.obj": b""}
    lines = [
        list(differences(Setting("stub").load(nodes + robot(device), files=files)))
        for device in ('Lidar { name "l" }', 'GPS { name "g" }')
    ]

    seen = "that no sensor sees: only a Mesh of an STL or OBJ file is seen"
    counted = [f"1 CadShape {seen}", f"2 Mesh {seen}", "1 Text that no sensor sees: the type is unknown"]
    assert [line for line in lines[0] if "no sensor" in line] == counted
    assert [line for line in lines[1] if "no sensor" in line] == []


def test_a_visible_mesh_that_is_also_a_bounding_object_counts_once():
    """Many worlds use the visible shape as the boundingObject (USE), so that robots touch what they see."""
    nodes = 'Solid { children [ DEF W Shape { geometry Mesh { url "a.stl" } } ] boundingObject USE W }'
    simulation = Setting("stub").load(nodes, files={"a.stl": binary(ONE)})

    assert "1 Mesh as boundingObject: robots touch its convex hull" in list(differences(simulation))
