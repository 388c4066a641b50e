"""Bodies and joints of a MuJoCo model as nodes, resets, and the changes that a supervisor may make."""

import math

import pytest

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.geometry import to_quaternion
from palaestra_sim.scene.tree.fields import FieldType
from tests.unit.mjcf.conftest import FORCE, POSITION, VELOCITY


def positions(simulation):
    """Return the positions of the cart, the ball and the pole."""
    return [simulation.tree.of_def(name).place.world_position for name in ("cart", "ball", "pole")]


def play(simulation, steps=20):
    """Push the cart back and forth, and return all sensor values and positions."""
    seen = []
    robot = simulation.robots[0]
    for step in range(steps):
        robot.motors["push"].set_effort(8.0 * math.sin(step))
        simulation.step(50)
        seen.append([sensor.value for sensor in robot.sensors.values()])
        seen.append(positions(simulation))
    return seen


def test_a_body_is_a_node_with_its_name_as_def_and_the_first_that_is_driven_is_the_robot(load):
    """A supervisor can find each body and each joint by its name in the model."""
    simulation = load()
    of_def = simulation.tree.of_def

    assert of_def("cart").type_name == "Robot"
    assert of_def("cart.pole").type_name == "Solid"
    assert of_def("slider").type_name == "SliderJoint"
    assert of_def("hinge").type_name == "HingeJoint"
    assert of_def("target").place.world_position == (3.0, 0.0, 0.5)
    assert simulation.robot_of(of_def("cart")) is simulation.robots[0]


def test_a_reset_returns_to_the_start_bit_for_bit(load):
    """The state after a reset depends neither on the past nor on values that were read between steps."""
    simulation = load()
    first = play(simulation)
    simulation.reset()
    simulation.step(10)

    assert simulation.time_ms == 10
    assert positions(simulation)[0] == (0.0, 0.0, 1.0)
    assert play(simulation) == first


def test_looking_changes_nothing(load):
    """Poses are computed when a client requests them, and the computation must not change the next step."""
    watched, other = load(), load()
    for simulation in (watched, other):
        simulation.robots[0].motors["push"].set_effort(3.0)
    for _ in range(40):
        watched.step(10)
        positions(watched)
    other.advance(400)

    assert positions(watched) == positions(other)


def test_a_world_begins_at_its_keyframe(load):
    """In the default pose of their model, most legged robots would fall."""
    changes = (
        ("<custom>", '<custom><text name="keyframe" data="tilted"/>'),
        ("<sensor>", '<keyframe><key name="tilted" qpos="0.5 0.3 1 1 0.5 1 0 0 0"/></keyframe><sensor>'),
    )
    simulation = load(FORCE, "", *changes)
    assert positions(simulation)[0][0] == 0.5

    simulation.step(100)
    simulation.reset()
    simulation.step(10)

    assert positions(simulation)[0][0] == 0.5


def home(control):
    """Return changes after which the world starts with the cart at 1 m and with the given control."""
    keyframe = f'<keyframe><key name="home" qpos="1 0 1 1 0.5 1 0 0 0" ctrl="{control}"/></keyframe>'
    named = '<custom><text name="keyframe" data="home"/>'
    return ("<custom>", named), ("<sensor>", f"{keyframe}<sensor>")


@pytest.mark.parametrize("velocity", [None, 5.0])
@pytest.mark.parametrize("reset", [False, True])
def test_a_servo_holds_the_position_of_the_keyframe_until_it_gets_another(load, velocity, reset):
    """A velocity command is not a target position.

    Without this rule a standing robot would move its legs to position 0.
    """
    simulation = load(POSITION, "", *home(control=1))
    motor = simulation.robots[0].motors["push"]
    if reset:
        motor.set_position(-1.0)
        simulation.step(100)
        simulation.reset()
        simulation.step(10)
    assert motor.target_rad == 1.0

    if velocity is not None:
        motor.set_velocity(velocity)
    simulation.step(1000)

    assert positions(simulation)[0][0] == pytest.approx(1.0, abs=0.02)


def test_a_servo_for_a_velocity_holds_where_the_world_begins(load):
    """Until it gets a target, a motor of Webots stays at the position in the world file."""
    simulation = load(VELOCITY, "", *home(control=0))
    simulation.robots[0].motors["push"].set_velocity(5.0)

    simulation.step(1000)

    assert positions(simulation)[0][0] == pytest.approx(1.0, abs=0.02)


@pytest.mark.parametrize("name", ["ball", "target"])
def test_a_field_moves_what_is_free_or_stands(load, name):
    """A task moves its target at each reset, and a reset of the world moves it back."""
    simulation = load()
    node = simulation.tree.of_def(name)
    start = node.place.world_position
    simulation.tree.field_of(node, "translation", simulation).set(FieldType.VEC3F, 0, (2.0, 1.0, 0.7))

    simulation.step(10)

    assert node.place.world_position == pytest.approx((2.0, 1.0, 0.7), abs=0.01)
    simulation.reset()
    simulation.step(10)
    assert node.place.world_position == start


@pytest.mark.parametrize("name", ["ball", "target"])
def test_a_field_turns_what_is_free_or_stands(load, name):
    """A task that places an object at random also turns it."""
    simulation = load(FORCE, "", ("<option", '<option gravity="0 0 0"'))
    node = simulation.tree.of_def(name)

    rotation = simulation.tree.field_of(node, "rotation", simulation)
    rotation.set(FieldType.ROTATION, 0, (0.0, 0.0, 1.0, 1.2))
    simulation.step(10)

    assert to_quaternion(node.place.world_pose.rotation) == pytest.approx(
        (0, 0, math.sin(0.6), math.cos(0.6))
    )
    simulation.reset()
    simulation.step(10)
    assert to_quaternion(node.place.world_pose.rotation) == pytest.approx((0, 0, 0, 1))


@pytest.mark.parametrize("position", [math.nan, math.inf, -math.inf])
def test_a_joint_stays_at_a_position_that_is_not_finite(load, position):
    """One NaN in the state would spread to every body of the model."""
    simulation = load()
    slider = simulation.tree.of_def("slider")
    simulation.set_joint_position(slider, 0.5, 1)

    simulation.set_joint_position(slider, position, 1)

    assert positions(simulation)[0] == (0.5, 0.0, 1.0)


def test_a_reset_of_the_physics_stops_all_motion_and_moves_nothing(load):
    """A supervisor uses it at the start of an episode, after it has placed all bodies."""
    simulation = load()
    simulation.robots[0].motors["push"].set_effort(5.0)
    simulation.step(100)
    before, ball = positions(simulation), simulation.tree.of_def("ball")
    assert simulation.motion.velocity(ball)[0][2] < -0.5

    simulation.reset_physics()

    assert simulation.motion.velocity(ball) == ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert positions(simulation) == before


def test_a_field_does_not_move_what_joints_move(load):
    """The physics would overwrite the position in the next step."""
    simulation = load()
    field = simulation.tree.field_of(simulation.tree.of_def("cart"), "translation", simulation)

    with pytest.raises(UnsimulatedError, match=r"Robot\.translation cannot be changed"):
        field.set(FieldType.VEC3F, 0, (1.0, 0.0, 1.0))


def test_a_joint_is_put_within_its_range(load):
    """A task may request any random position at the start of an episode.

    The joint must stay within its range.
    """
    simulation = load()

    simulation.set_joint_position(simulation.tree.of_def("slider"), 9.0, 1)

    assert positions(simulation)[0] == (2.0, 0.0, 1.0)
    for node, index in (("cart", 1), ("slider", 2)):
        with pytest.raises(UnsimulatedError):
            simulation.set_joint_position(simulation.tree.of_def(node), 0.0, index)


def test_velocities_and_forces_of_free_bodies(load):
    """The force accelerates a ball of 4.19 kg at 3 m/s2, for a tenth of a second."""
    simulation = load(FORCE, "", ("<option", '<option gravity="0 0 0"'))
    ball = simulation.tree.of_def("ball")
    simulation.motion.set_velocity(ball, (1.0, 0.0, 0.0), (0.0, 0.0, 2.0))
    assert simulation.motion.velocity(ball) == (pytest.approx((1, 0, 0)), pytest.approx((0, 0, 2)))

    for _ in range(10):
        simulation.motion.add_force(ball, (0.0, 4.19 * 3.0, 0.0), relative=False)
        simulation.step(10)
    simulation.step(10)

    assert simulation.motion.velocity(ball)[0] == pytest.approx((1.0, 0.3, 0.0), abs=0.01)
    simulation.motion.halt(ball)
    assert simulation.motion.velocity(ball)[0] == (0.0, 0.0, 0.0)


def test_a_body_on_joints_takes_no_velocity(load):
    """The velocity of such a body follows from the speeds of its joints."""
    simulation = load()

    with pytest.raises(UnsimulatedError, match="'pole' is on joints or fixed, so its velocity cannot be set"):
        simulation.motion.set_velocity(simulation.tree.of_def("pole"), (1.0, 0.0, 0.0), (0.0, 0.0, 0.0))


def test_a_center_of_mass_includes_the_bodies_inside(load):
    """MuJoCo computes it from the masses of the model, which the nodes do not have."""
    simulation = load()
    for name in ("cart", "pole", "ball"):
        node = simulation.tree.of_def(name)

        found = simulation.motion.center_of_mass(node)

        bodies = simulation.nodes.bodies
        inside = [bodies[it] for it in (node, *node.descendants()) if it in bodies]
        masses = simulation.model.model.body_mass[inside]
        expected = masses @ simulation.model.data.xipos[inside] / masses.sum()
        assert found == pytest.approx(tuple(expected))


def test_contact_points_are_where_a_body_touches(load):
    """While the ball falls, it touches nothing.

    When it lies on the floor, the contact point is below its center.
    """
    simulation = load()
    ball = simulation.tree.of_def("ball")
    assert simulation.contact_points(ball, descendants=False) == []

    simulation.step(2000)
    ((point, number),) = simulation.contact_points(ball, descendants=False)

    assert point == pytest.approx((1.0, 1.0, 0.0), abs=0.01)
    assert number == ball.number


def test_a_state_of_a_node_is_saved_and_loaded(load):
    """Only the joints below this node return to the saved state."""
    simulation = load()
    cart = simulation.tree.of_def("cart")
    simulation.set_joint_position(simulation.tree.of_def("slider"), 0.5, 1)
    simulation.save_state(cart, "half")
    simulation.step(500)
    fallen = positions(simulation)[1]

    simulation.load_state(cart, "__init__")
    assert positions(simulation)[0] == (0.0, 0.0, 1.0)
    simulation.load_state(cart, "half")

    assert positions(simulation)[0] == (0.5, 0.0, 1.0)
    assert positions(simulation)[1] == fallen
    with pytest.raises(UnsimulatedError, match="no state 'other'; save it first"):
        simulation.load_state(cart, "other")


def test_a_state_has_the_poses_of_bodies_without_joints(load):
    """A supervisor may move such a body, for example a target, so a loaded state returns it too."""
    hand = '<body name="hand" mocap="true" pos="0 2 1"><geom size="0.1" contype="0" conaffinity="0"/></body>'
    simulation = load(FORCE, "", ('<body name="target"', hand + '<body name="target"'))
    root, of_def = simulation.tree.root, simulation.tree.of_def
    starts = [of_def(name).place.world_position for name in ("target", "hand")]
    simulation.save_state(root, "start")
    for state in ("__init__", "start"):
        for name in ("target", "hand"):
            field = simulation.tree.field_of(of_def(name), "translation", simulation)
            field.set(FieldType.VEC3F, 0, (5.0, 5.0, 5.0))
        simulation.step(10)
        assert of_def("hand").place.world_position == (5.0, 5.0, 5.0)

        simulation.load_state(root, state)

        assert [of_def(name).place.world_position for name in ("target", "hand")] == starts


def test_a_contact_of_a_cloth_is_that_of_its_own_body(load):
    """A flex has no geom; its contacts were those of the last geom of the model."""
    cloth = """<flexcomp name="cloth" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" dim="2" mass="0.1"
      pos="6 6 0.02" radius="0.01"><contact selfcollide="none"/></flexcomp>"""
    simulation = load(FORCE, "", ('<body name="target"', cloth + '<body name="target"'))
    simulation.step(500)
    of_def = simulation.tree.of_def

    assert simulation.contact_points(of_def("target"), descendants=True) == []
    assert len(simulation.contact_points(of_def("cloth_3"), descendants=False)) == 1


def test_the_same_follows_from_a_loaded_state_each_time(load):
    """The results are bitwise equal, because the solver keeps no value from the time before."""
    simulation = load()
    simulation.step(2000)  # the ball then lies on the floor, so that the solver must handle contacts
    simulation.save_state(simulation.tree.root, "lying")
    played = []
    for _ in range(2):
        simulation.load_state(simulation.tree.root, "lying")
        played.append(play(simulation))

    assert played[0] == played[1]


def test_nothing_is_added_to_or_removed_from_a_model(load):
    """MuJoCo compiles a model once, at the start, so bodies cannot be added or removed later."""
    simulation = load()
    root = simulation.tree.field_of(simulation.tree.root, "children", simulation)

    with pytest.raises(UnsimulatedError, match="cannot change while it runs"):
        simulation.add("Solid { }", root, -1)
    with pytest.raises(UnsimulatedError, match="cannot change while it runs"):
        simulation.remove(simulation.tree.of_def("ball"))


def test_a_model_that_explodes_has_values_that_are_no_numbers(load):
    """MuJoCo would silently reset the simulation. A client must see NaN, which it treats as a fault."""
    simulation = load(VELOCITY)
    simulation._model.data.qvel[0] = math.nan

    simulation.step(20)

    assert math.isnan(simulation.robots[0].sensors["cart position"].value)


def test_the_basic_step_is_the_shortest_that_fits_the_timestep(load):
    """The basic step is a whole number of milliseconds, because a controller counts in milliseconds."""
    without = ('<numeric name="basicTimeStep" data="10"/>', "")

    assert load(FORCE, "", without).basic_step_ms == 2
    assert load(FORCE, "", without, ('timestep="0.002"', 'timestep="0.0025"')).basic_step_ms == 5
    with pytest.raises(
        ValueError, match="3 ms is not a positive multiple of the basic step; use a multiple of 2 ms"
    ):
        load(FORCE, "", without).step(3)
