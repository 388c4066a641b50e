"""The data that a viewer gets of a world: nodes, visible shapes, and the poses of moving nodes."""

import json
import math

import pytest

from palaestra_protocol.scene import WORLD, SceneState, ShapeKind, VisibleScene
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin
from palaestra_sim.world.builtin import builtin_path
from tests.scenes import load_scene

WORLD_FILE = b"""#VRML_SIM R2023b utf8
WorldInfo { basicTimeStep 32 }
DEF FLOOR Solid { children [ Shape { geometry Plane { size 4 2 } } ] }
DEF MARK Solid { translation 1 0 0.1
  children [ Pose { translation 0 0 1 children [ Shape {
    appearance PBRAppearance { baseColor 1 0 0 transparency 0.5 }
    geometry Cylinder { radius 0.2 height 0.3 } } ] } ] }
Shape { geometry IndexedFaceSet { coord Coordinate { point [ 0 0 0, 1 0 0, 0 1 0 ] } coordIndex [ 0 1 2 ] } }
Robot { name "arm" children [
  Shape { geometry Box { size 0.1 0.2 0.3 } }
  HingeJoint {
    jointParameters HingeJointParameters { axis 0 0 1 }
    device [ RotationalMotor { name "hip" maxVelocity 100 } ]
    endPoint Solid { translation 0.5 0 0 name "leg"
      children [ Pose { translation 0 0 0.2 children [ Shape { geometry Sphere { radius 0.1 } } ] } ] }
  }
] }
"""


@pytest.fixture
def simulation():
    """Return the simulation of a floor, a marker, a triangle and an arm with one joint."""
    return load_scene(WORLD_FILE)


def scene_of(simulation):
    """Return the scene as a viewer decodes it."""
    return VisibleScene.from_json(json.loads(json.dumps(simulation.appearance.scene("world.wbt").to_json())))


def state_of(simulation):
    """Return the state as a viewer decodes it."""
    text = json.dumps(simulation.appearance.state(simulation.time_ms).to_json())
    return SceneState.from_json(json.loads(text))


def test_each_frame_with_shapes_is_a_node_and_parts_of_robots_bear_its_name(simulation):
    """Two robots may have parts with the same name, so a node has its robot's name in front."""
    nodes = {node.name: node for node in scene_of(simulation).nodes}

    assert nodes.keys() == {WORLD, "FLOOR", "Pose", "arm", "arm/leg"}
    assert (nodes["arm"].robot, nodes["arm"].moves) == (True, False), "it has no wheels"
    assert (nodes["arm/leg"].parent, nodes["arm/leg"].moves) == ("arm", True)


def test_shapes_keep_size_color_and_place(simulation):
    """A viewer renders the shapes without access to the world file."""
    nodes = {node.name: node for node in scene_of(simulation).nodes}
    (mark,) = nodes["Pose"].shapes
    (floor,) = nodes["FLOOR"].shapes
    (ball,) = nodes["arm/leg"].shapes

    assert (mark.kind, mark.size, mark.color) == (
        ShapeKind.CYLINDER,
        (0.4, 0.4, 0.3),
        (1.0, 0.0, 0.0, 0.5),
    )
    assert nodes["Pose"].pose[:3] == (1.0, 0.0, 1.1)
    assert (floor.kind, floor.size, floor.pose[:3]) == (ShapeKind.PLANE, (4.0, 2.0, 0.0), (0.0, 0.0, 0.0))
    assert ball.pose[:3] == (0.0, 0.0, 0.2), "in the frame of what carries it"


def test_faces_are_triangles_that_shapes_share(simulation):
    """A mesh is sent once, even if several shapes use it."""
    scene = scene_of(simulation)
    (shape,) = next(node for node in scene.nodes if node.name == WORLD).shapes

    assert shape.kind is ShapeKind.MESH
    assert len(scene.meshes[shape.mesh].triangles) >= 1


def test_a_state_has_what_moves_and_the_positions_of_motors(simulation):
    """A viewer needs only the values that may have changed, so the state omits nodes that cannot move."""
    simulation.robots[0].motors["hip"].set_position(math.pi / 2.0)
    for _ in range(20):
        simulation.step(32)

    state = state_of(simulation)

    assert state.joints["hip"] == pytest.approx(math.pi / 2.0, abs=1e-3)
    assert state.poses.keys() == {"arm/leg"}
    assert state.poses["arm/leg"][3:] == pytest.approx((math.sqrt(0.5), 0, 0, math.sqrt(0.5)), abs=1e-3)
    assert state.time_s == pytest.approx(20 * 0.032)


def test_what_a_client_moves_is_in_the_state_and_needs_no_new_scene():
    """An environment moves its target at each episode; a new scene for that could have megabytes."""
    simulation = load_scene(builtin("arena"), "arena.wbt")
    before = scene_of(simulation)
    mark = next(node for node in simulation.tree.nodes.values() if node.def_name == "TARGET")

    simulation.changed(mark, "translation")
    assert "TARGET" not in state_of(simulation).poses, "it has not moved"
    mark.place.translation = (1.0, 2.0, 0.0)
    simulation.changed(mark, "rotation")

    state = state_of(simulation)
    assert state.poses["TARGET"][:2] == (1.0, 2.0)
    assert state.revision == before.revision


def test_a_new_look_is_a_new_revision(simulation):
    """A viewer requests the scene again when the revision of a state has changed."""
    before = scene_of(simulation)

    children = next(node for node in simulation.tree.nodes.values() if node.def_name == "MARK")
    simulation.remove(children)

    assert state_of(simulation).revision != before.revision
    assert "Pose" not in {node.name for node in scene_of(simulation).nodes}


@pytest.mark.parametrize("world", ["pen", "court"])
def test_a_robot_without_visible_shapes_has_those_with_which_it_collides(world):
    """The built-in E-puck and TurtleBot3 have only collision shapes and would otherwise be invisible."""
    path = builtin_path(world)
    assert path is not None

    scene = scene_of(Loader(physics=StubPhysics)(path, Mode.FAST))

    (robot,) = (node for node in scene.nodes if node.robot)
    assert robot.shapes


def test_a_mesh_that_is_too_large_becomes_its_box(simulation, monkeypatch):
    """A remote viewer has limited memory, so a mesh with too many points is sent as its bounding box."""
    monkeypatch.setattr("palaestra_sim.scene.appearance.MOST_POINTS", 2)

    scene = scene_of(simulation)

    (shape,) = next(node for node in scene.nodes if node.name == WORLD).shapes
    assert shape.kind is ShapeKind.BOX
    assert scene.simplified == 1


def test_nothing_is_computed_before_somebody_asks(simulation):
    """A run without a viewer must not be slower."""
    simulation.step(32)

    assert simulation.appearance._nodes == []
