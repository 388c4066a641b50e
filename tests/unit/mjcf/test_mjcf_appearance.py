"""A viewer gets the bodies and geoms of a MuJoCo model, and the poses after each step."""

import json

import pytest

from palaestra_protocol.scene import WORLD, SceneState, ShapeKind, VisibleScene
from tests.unit.mjcf.conftest import FORCE


@pytest.fixture
def simulation(load):
    """Return the simulation of the cart with its pole."""
    return load()


def scene_of(simulation):
    """Return the scene as a viewer reads it."""
    return VisibleScene.from_json(json.loads(json.dumps(simulation.appearance.scene("cart.xml").to_json())))


def state_of(simulation):
    """Return the state as a viewer reads it."""
    text = json.dumps(simulation.appearance.state(simulation.time_ms).to_json())
    return SceneState.from_json(json.loads(text))


def test_each_body_is_a_node(simulation):
    """The viewer's tree of nodes is the model's tree of bodies."""
    nodes = {node.name: node for node in scene_of(simulation).nodes}

    assert nodes.keys() == {WORLD, "cart", "pole", "ball", "target"}
    assert (nodes["pole"].parent, nodes["pole"].moves) == ("cart", True)
    assert (nodes["cart"].robot, nodes["target"].moves) == (True, False)


def test_geoms_have_whole_sizes(simulation):
    """MuJoCo's sizes are half sizes, and its height of a capsule does not include the caps."""
    nodes = {node.name: node for node in scene_of(simulation).nodes}
    (floor,), (pole,), (ball,) = (nodes[name].shapes for name in (WORLD, "pole", "ball"))

    assert (floor.kind, floor.size) == (ShapeKind.PLANE, (0.0, 0.0, 0.0)), "it has no end"
    assert (pole.kind, pole.size) == (ShapeKind.CAPSULE, pytest.approx((0.06, 0.06, 0.6)))
    assert (ball.kind, ball.size) == (ShapeKind.SPHERE, (0.2, 0.2, 0.2))
    assert nodes["cart"].shapes[0].size == (0.2, 0.2, 0.1)


def test_a_state_has_the_bodies_that_joints_move_and_their_positions(simulation):
    """Only a body that joints move needs a new pose: the falling ball does, but the fixed target does not."""
    before = scene_of(simulation)
    for _ in range(10):
        simulation.step(10)

    state = state_of(simulation)

    assert state.poses.keys() == {"cart", "pole", "ball"}
    assert state.poses["ball"][2] < 0.5
    assert state.joints.keys() == {"slider", "hinge"}
    assert (state.time_s, state.revision) == (pytest.approx(0.1), before.revision)


def test_looking_changes_nothing_on_which_the_next_step_depends(load):
    """A run with a viewer and the same run without it have equal results, bit for bit."""
    watched, alone = load(), load()
    for _ in range(20):
        watched.appearance.state(watched.time_ms)
        watched.step(10)
        alone.step(10)

    assert watched._model.data.qpos.tolist() == alone._model.data.qpos.tolist()


def test_a_mesh_and_a_height_field_are_triangles(load):
    """Most robot models for MuJoCo consist of meshes."""
    assets = """<asset><mesh name="wedge" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/>
      <hfield name="hill" nrow="2" ncol="3" size="2 1 0.5 0.1" elevation="0 1 0 0 0 1"/></asset><worldbody>
      <geom type="mesh" mesh="wedge" rgba="1 0 0 1"/><geom type="hfield" hfield="hill"/>"""
    scene = scene_of(load(FORCE, "", ("<worldbody>", assets)))

    shapes = [shape for shape in scene.nodes[0].shapes if shape.kind is ShapeKind.MESH]
    wedge, hill = (scene.meshes[shape.mesh] for shape in shapes)
    assert (len(wedge.points), len(wedge.triangles)) == (4, 4)
    assert (len(hill.points), len(hill.triangles)) == (6, 4)
    assert max(z for _, _, z in hill.points) == pytest.approx(0.5)
    assert shapes[0].color == (1.0, 0.0, 0.0, 1.0)
