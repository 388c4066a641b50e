"""Fields over ROS: values, rotations, and the time at which a write takes effect."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.scene.geometry import axis_angle_to_quaternion
from palaestra_sim.scene.tree.fields import quaternion_to_axis_angle

HALF = math.sqrt(0.5)


def xyz(vector):
    """Return a vector message as a tuple."""
    return vector.x, vector.y, vector.z


def test_values_of_the_world_file_and_defaults_are_read(robot, field):
    """A client cannot see whether a value comes from the world file or is the default."""
    get = robot.get

    assert xyz(get("supervisor/field/get_vec3f", field=field("TARGET", "translation"))) == (1.5, 0, 0.001)
    assert get("supervisor/field/get_float", field=field("BODY", "radius")) == 0.2266
    assert get("supervisor/field/get_bool", field=field("ROBOTINO", "supervisor")) == 1
    assert get("supervisor/field/get_string", field=field("ROBOTINO", "name")) == "robotino"
    assert get("supervisor/field/get_int32", field=field("BODY", "subdivision")) == 36
    assert get("supervisor/field/get_string", field=field("ROBOTINO", "window")) == "<generic>"
    assert xyz(get("supervisor/field/get_vec3f", field=field("TARGET", "translation"), index=7))[0] == 1.5


def test_colors_are_opaque_and_vec2f_travels_as_a_vector(ros, start, world):
    """In these response types, a color has an alpha, and a vector has three numbers."""
    start(
        world(
            "DEF LIGHT DirectionalLight { color 1 0.5 0.25 } DEF P Pose { children [ Shape {"
            " geometry DEF PLANE Plane { size 3 4 } } ] }"
        )
    )
    robot = ros.node("robotino")

    def find(def_name, name):
        node = robot.get("supervisor/get_from_def", name=def_name)
        return robot.get("supervisor/node/get_field", node=node, fieldName=name)

    color = robot.get("supervisor/field/get_color", field=find("LIGHT", "color"))
    size = robot.get("supervisor/field/get_vec2f", field=find("PLANE", "size"))

    assert (color.r, color.g, color.b, color.a) == pytest.approx((1.0, 0.5, 0.25, 1.0))
    assert xyz(size) == (3.0, 4.0, 0.0)


def test_mf_values_are_read_by_index(robot, field):
    """As in libController, a negative index counts from the end."""
    handle = field("ROBOTINO", "controllerArgs")

    values = [robot.get("supervisor/field/get_string", field=handle, index=index) for index in (0, 1, -1)]

    assert values == ["--name=robotino", "--synchronize", "--clock"]


def test_nodes_of_fields_are_handles(robot, field):
    """If the field has no node at an index, or contains other values, the handle is 0."""
    children = field("TARGET", "children")

    first = robot.get("supervisor/field/get_node", field=children, index=0)

    assert robot.get("supervisor/node/get_type_name", node=first) == "Shape"
    assert robot.get("supervisor/field/get_node", field=children, index=5) == 0
    assert robot.get("supervisor/field/get_node", field=field("TARGET", "translation")) == 0


def test_a_written_value_is_read_at_once_and_seen_with_the_next_step(robot, field, position):
    """As in Webots, the field returns the new value at once, but the node moves with the next step."""
    handle = field("TARGET", "translation")

    assert robot.get("supervisor/field/set_vec3f", field=handle, value={"x": -1.0, "y": 0.5}) == 1
    assert xyz(robot.get("supervisor/field/get_vec3f", field=handle)) == (-1.0, 0.5, 0.0)
    assert position(robot, "TARGET") == (1.5, 0.0, 0.001)
    robot.call("robot/time_step", value=32)

    assert position(robot, "TARGET") == (-1.0, 0.5, 0.0)


def test_the_last_of_several_writes_wins(robot, field, position):
    """A client may correct a value before the step, and then the correction must apply."""
    handle = field("TARGET", "translation")
    for x in (0.1, 0.2, 0.3):
        robot.call("supervisor/field/set_vec3f", field=handle, value={"x": x})

    robot.call("robot/time_step", value=32)

    assert position(robot, "TARGET") == (0.3, 0.0, 0.0)


def test_a_robot_is_moved_by_its_translation_and_rotation(robot, field, position):
    """An environment places its robot in this way at the start of an episode."""
    robot.call(
        "supervisor/field/set_vec3f",
        field=field("ROBOTINO", "translation"),
        value={"x": 1.2, "y": -0.3},
    )
    robot.call(
        "supervisor/field/set_rotation",
        field=field("ROBOTINO", "rotation"),
        value={"z": HALF, "w": HALF},
    )

    robot.call("robot/time_step", value=32)
    handle = robot.get("supervisor/get_from_def", name="ROBOTINO")
    turned = robot.get("supervisor/node/get_orientation", node=handle)

    assert position(robot, "ROBOTINO") == (1.2, -0.3, 0.0)
    assert (turned.z, turned.w) == pytest.approx((HALF, HALF))


def test_the_translation_of_a_robot_is_where_it_is(robot, field, drive):
    """An environment reads the robot's position from this field, so the field must follow the robot."""
    drive(robot, 0.1, 0.0, 0.0)

    robot.call("robot/time_step", value=3200)

    point = robot.get("supervisor/field/get_vec3f", field=field("ROBOTINO", "translation"))
    assert xyz(point) == pytest.approx((0.32, 0.0, 0.0))


def test_an_obstacle_that_is_moved_is_seen_where_it_is(robot, field):
    """An environment may move obstacles between episodes, and the policy must see their new positions."""
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=32)
    robot.call(
        "supervisor/field/set_vec3f",
        field=field("CYLINDER_0", "translation"),
        value={"x": 0.6, "z": 0.2},
    )

    robot.call("robot/time_step", value=32)

    assert inbox[0] == pytest.approx(1.1, rel=0.2)


def test_a_write_beyond_the_values_that_there_are_is_lost(robot, field):
    """Webots' controller also reports success for such a write, so a client must check the count itself."""
    handle = field("ROBOTINO", "controllerArgs")

    assert robot.get("supervisor/field/set_string", field=handle, index=9, value="x") == 1
    assert robot.get("supervisor/field/get_string", field=handle, index=9) == ""


def test_values_that_are_drawn_only_are_kept_and_change_nothing(ros, start, world):
    """A visual value is stored, but it has no effect on physics, as in Webots."""
    shape = "Shape { appearance DEF PAINT PBRAppearance { } geometry DEF DOT Cylinder { radius 0.1 } }"
    start(world(f"Pose {{ children [ {shape} ] }}"))
    robot = ros.node("robotino")
    for definition, name in (("PAINT", "roughness"), ("DOT", "radius")):
        node = robot.get("supervisor/get_from_def", name=definition)
        handle = robot.get("supervisor/node/get_field", node=node, fieldName=name)

        robot.call("supervisor/field/set_float", field=handle, value=0.5)

        assert robot.get("supervisor/field/get_float", field=handle) == 0.5


@pytest.mark.parametrize(
    ("path", "setter", "value", "fact"),
    [
        ("BODY.radius", "set_float", 0.3, "Cylinder.radius of a boundingObject"),
        ("CYLINDER_0_SHAPE.subdivision", "set_int32", 8, "Cylinder.subdivision of a boundingObject"),
        ("ROBOTINO.controllerArgs", "set_string", "--clock", "Robot.controllerArgs"),
    ],
)
def test_a_write_that_would_be_read_back_and_change_nothing_is_refused(
    robot, field, path, setter, value, fact
):
    """A client that randomizes sizes would otherwise train in the same world all the time."""
    handle = field(*path.split("."))

    with pytest.raises(
        ServiceFailed, match=f"{fact} cannot be changed while the simulator runs; change the world file"
    ):
        robot.call(f"supervisor/field/{setter}", field=handle, value=value)


JOINT_OF_AN_ARM = """
DEF JOINT {joint} {{
  jointParameters {parameters} {{ minStop -1 maxStop 1 }}
  endPoint DEF END Solid {{ name "end" }}
}}
"""


@pytest.mark.parametrize(
    ("joint", "parameters"),
    [
        ("HingeJoint", "HingeJointParameters"),
        ("SliderJoint", "JointParameters"),
        ("Hinge2Joint", "HingeJointParameters"),
        ("BallJoint", "BallJointParameters"),
    ],
)
def test_the_limits_of_a_joint_cannot_be_written(ros, start, world, simple_robot, joint, parameters):
    """The limits are read at the start, so a client that randomizes them would train with the first ones."""
    text = JOINT_OF_AN_ARM.format(joint=joint, parameters=f"DEF LIMITS {parameters}")
    start(world(robot=simple_robot.replace("children [", f"children [ {text}", 1)))
    node = ros.node("robotino")
    limits = node.get("supervisor/get_from_def", name="LIMITS")
    stop = node.get("supervisor/node/get_field", node=limits, fieldName="minStop")

    with pytest.raises(ServiceFailed, match=rf"{parameters}\.minStop cannot be changed while"):
        node.call("supervisor/field/set_float", field=stop, value=-0.5)


def test_the_sensor_of_a_robot_cannot_be_moved_by_field(robot, simple_robot, ros, start, world):
    """The rays of a sensor start at its position in the world file, so a write would have no effect."""
    del robot
    start(world(robot=simple_robot))
    node = ros.node("robotino")
    handle = node.get("supervisor/get_from_def", name="IR")
    translation = node.get("supervisor/node/get_field", node=handle, fieldName="translation")

    with pytest.raises(ServiceFailed, match=r"DistanceSensor\.translation cannot be changed"):
        node.call("supervisor/field/set_vec3f", field=translation, value={"x": 0.1})


def test_custom_data_can_be_written_both_ways(robot, field):
    """`set_custom_data` takes effect at once; a write to the field takes effect with the next step."""
    handle = field("ROBOTINO", "customData")
    robot.call("robot/set_custom_data", value="a")
    assert robot.get("supervisor/field/get_string", field=handle) == "a"

    robot.call("supervisor/field/set_string", field=handle, value="b")
    assert robot.get("robot/get_custom_data") == "a"
    robot.call("robot/time_step", value=32)

    assert robot.get("robot/get_custom_data") == robot.get("robot/get_data") == "b"


def test_an_episode_is_seeded_by_custom_data_and_reset_in_one_step(robot, field):
    """The write takes effect before the reset, so an environment needs only one step for both."""
    handle = field("ROBOTINO", "customData")
    inbox = robot.inbox("ir1/value")
    robot.call("ir1/enable", value=192)
    runs = []
    for seed in ("3", "4", "3"):
        robot.call("supervisor/field/set_string", field=handle, value=f'{{"seed": {seed}}}')
        robot.call("supervisor/simulation_reset")
        del inbox[:]
        for _ in range(5):
            robot.call("robot/time_step", value=192)
        runs.append(list(inbox))

    assert runs[0] == runs[2] != runs[1]
    assert robot.get("supervisor/field/get_string", field=handle) == '{"seed": 3}'


def test_a_reset_restores_places_and_not_other_fields(robot, field, position):
    """As in Webots, a reset restores poses, but keeps other written fields."""
    robot.call("supervisor/field/set_vec3f", field=field("TARGET", "translation"), value={"x": -1.0})
    robot.call("supervisor/field/set_string", field=field("ROBOTINO", "description"), value="new")
    robot.call("robot/time_step", value=32)
    robot.call("supervisor/simulation_reset")
    robot.call("robot/time_step", value=32)

    assert position(robot, "TARGET") == (1.5, 0.0, 0.001)
    assert robot.get("robot/get_time") == pytest.approx(0.032)
    assert robot.get("supervisor/field/get_string", field=field("ROBOTINO", "description")) == "new"


@pytest.mark.parametrize("bad", [math.nan, math.inf, -math.inf])
def test_a_value_that_libcontroller_refuses_answers_success(robot, field, bad):
    """As in libController, the call succeeds and the field keeps its value."""
    handle = field("TARGET", "translation")

    assert robot.get("supervisor/field/set_vec3f", field=handle, value={"x": bad}) == 1

    assert xyz(robot.get("supervisor/field/get_vec3f", field=handle)) == (1.5, 0.0, 0.001)


def test_a_value_of_the_wrong_type_answers_success(robot, field):
    """Webots' controller responds with success too, so a client does not notice the wrong type."""
    handle = field("TARGET", "translation")

    assert robot.get("supervisor/field/set_float", field=handle, value=1.0) == 1
    assert robot.get("supervisor/field/set_string", field=handle, value="x") == 1
    assert robot.get("supervisor/field/set_vec3f", field=field("BODY", "radius"), value={}) == 1


def test_a_read_of_the_wrong_type_answers_nothing_or_fails(robot, field):
    """The result is 0 or "", as in libController.

    For a vector, the real controller would read a null pointer and crash, so this call fails.
    """
    handle = field("TARGET", "translation")

    assert robot.get("supervisor/field/get_float", field=handle) == 0.0
    assert robot.get("supervisor/field/get_string", field=handle) == ""
    with pytest.raises(ServiceFailed, match=r"radius .SFFloat. has no VEC3F"):
        robot.call("supervisor/field/get_vec3f", field=field("BODY", "radius"))


def test_mf_values_can_be_set_inserted_and_removed(robot, field):
    """A client needs the response 0 to notice a wrong index, or an SF field, which has only one value."""
    root = robot.get("supervisor/get_root")
    children = robot.get("supervisor/node/get_field", node=root, fieldName="children")
    world_info = robot.get("supervisor/field/get_node", field=children, index=0)
    handle = robot.get("supervisor/node/get_field", node=world_info, fieldName="info")

    def values():
        count = robot.get("supervisor/field/get_count", field=handle)
        return [robot.get("supervisor/field/get_string", field=handle, index=i) for i in range(count)]

    assert robot.get("supervisor/field/insert_string", field=handle, index=0, value="first") == 1
    assert robot.get("supervisor/field/insert_string", field=handle, index=-1, value="last") == 1
    assert robot.get("supervisor/field/set_string", field=handle, index=1, value="second") == 1
    assert values() == ["first", "second", "last"]
    assert robot.get("supervisor/field/remove", field=handle, index=0) == 1
    assert robot.get("supervisor/field/remove", field=handle, index=9) == 0
    assert robot.get("supervisor/field/insert_string", field=handle, index=9, value="x") == 0
    assert values() == ["second", "last"]
    translation = field("TARGET", "translation")
    assert robot.get("supervisor/field/insert_vec3f", field=translation, index=0, value={}) == 0
    assert robot.get("supervisor/field/remove", field=translation, index=0) == 0


def test_tracking_of_a_field_is_accepted(robot, field):
    """Tracking only makes responses of Webots faster, so the stub accepts the call and does nothing."""
    handle = field("TARGET", "translation")

    assert robot.get("supervisor/field/enable_sf_tracking", field=handle, sampling_period=32) == 1


def test_a_rotation_of_zero_cannot_be_written_back(robot, field):
    """The real controller has this bug: a client reads the identity, and writing it back has no effect."""
    handle = field("ROBOTINO", "rotation")
    saved = robot.get("supervisor/field/get_rotation", field=handle)
    assert (saved.x, saved.y, saved.z, saved.w) == (0.0, 0.0, 0.0, 1.0)
    turned = {"z": HALF, "w": HALF}
    robot.call("supervisor/field/set_rotation", field=handle, value=turned)
    robot.call("robot/time_step", value=32)

    identity = {"x": 0.0, "y": 0.0, "z": 0.0, "w": 1.0}
    assert robot.get("supervisor/field/set_rotation", field=handle, value=identity) == 1
    robot.call("robot/time_step", value=32)

    assert robot.get("supervisor/field/get_rotation", field=handle).z == pytest.approx(HALF)


def test_the_workaround_writes_a_rotation_of_zero(robot, field):
    """With a tiny z and w = 1, the axis is z and the angle exactly 0, so the write takes effect."""
    handle = field("ROBOTINO", "rotation")
    robot.call("supervisor/field/set_rotation", field=handle, value={"z": HALF, "w": HALF})
    robot.call("robot/time_step", value=32)

    robot.call("supervisor/field/set_rotation", field=handle, value={"z": 1e-6, "w": 1.0})
    robot.call("robot/time_step", value=32)

    restored = robot.get("supervisor/field/get_rotation", field=handle)
    assert (restored.x, restored.y, restored.z, restored.w) == (0.0, 0.0, 0.0, 1.0)


@pytest.mark.parametrize("w", [1.0000001, -1.5, math.nan])
def test_a_quaternion_that_is_not_of_length_1_makes_the_angle_nan(w):
    """A write with such a quaternion is rejected, so a client must normalize it first."""
    assert math.isnan(quaternion_to_axis_angle(0.0, 0.0, 0.1, w)[3])


@given(
    angle=st.floats(0.001, 6.2),
    axis=st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda a: math.hypot(*a) > 0.1),
)
def test_other_rotations_survive_the_way_there_and_back(angle, axis):
    """A client may save a rotation and restore it later; only rounding may change the rotation."""
    length = math.hypot(*axis)
    unit = tuple(it / length for it in axis)
    x, y, z, w = axis_angle_to_quaternion((*unit, angle))

    back = quaternion_to_axis_angle(x, y, z, max(-1.0, min(1.0, w)))

    assert back[3] == pytest.approx(angle, abs=1e-4)
    assert back[:3] == pytest.approx(unit, abs=1e-4)
