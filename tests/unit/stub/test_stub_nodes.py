"""The scene tree over ROS: clients find, read and move nodes."""

import math

import pytest

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.world import builtin


@pytest.fixture
def find(robot):
    """`find("TARGET")` returns the handle of a node by its DEF."""
    return lambda name: robot.get("supervisor/get_from_def", name=name)


def test_a_def_that_does_not_exist_is_handle_0(find):
    """A client may look for a node that is absent, so the response is a success with the handle 0."""
    assert find("NOBODY") == 0
    assert find("") == 0
    assert find("ROBOTINO.NOBODY") == 0


def test_handles_look_like_addresses_and_stay_the_same(find):
    """In Webots a handle is the address of a node, so it is large, and a client may keep it."""
    assert find("TARGET") == find("TARGET") > 2**40
    assert find("TARGET") != find("ROBOTINO")


def test_dots_lead_inside(find):
    """The path ROBOTINO.BODY leads to a node inside ROBOTINO; TARGET has no such node."""
    assert find("ROBOTINO.BODY") == find("BODY") != 0
    assert find("TARGET.BODY") == 0


def test_a_protos_inside_is_not_found_where_there_are_no_protos(robot, find):
    """`proto` searches inside a PROTO, and ROBOTINO is not an instance of a PROTO."""
    assert robot.get("supervisor/get_from_def", name="BODY", proto=find("ROBOTINO")) == 0


def test_a_node_tells_what_it_is(robot, find):
    """The type numbers are those of webots/nodes.h."""
    target, robotino = find("TARGET"), find("ROBOTINO")

    assert robot.get("supervisor/node/get_type_name", node=robotino) == "Robot"
    assert robot.get("supervisor/node/get_base_type_name", node=robotino) == "Robot"
    assert robot.get("supervisor/node/get_type", node=robotino) == 34
    assert robot.get("supervisor/node/get_type", node=target) == 26
    assert robot.get("supervisor/node/get_type", node=find("CYLINDER_0")) == 80
    assert robot.get("supervisor/node/get_def", node=target) == "TARGET"
    assert robot.get("supervisor/node/is_proto", node=target) is False


@pytest.fixture
def among_protos(ros, start, world):
    """Return a supervisor that is a PROTO E-puck, and a function that finds nodes by DEF.

    The world also has a stand-in, a WoodenBox.
    """
    arguments = 'controllerArgs [ "--name=puck" "--synchronize" ]'
    robot = f'DEF PUCK E-puck {{ controller "ros" {arguments} supervisor TRUE }}'
    start(world("DEF BOX WoodenBox { translation 2 0 0 }", robot=robot))
    puck = ros.node("puck")
    return puck, lambda name, **proto: puck.get("supervisor/get_from_def", name=name, **proto)


@pytest.mark.parametrize(
    ("name", "proto", "base", "number"), [("PUCK", "E-puck", "Robot", 34), ("BOX", "WoodenBox", "Solid", 80)]
)
def test_an_instance_of_a_proto_has_the_name_of_the_proto(among_protos, name, proto, base, number):
    """The base type is that of the node inside the PROTO, even if a stand-in replaces the PROTO."""
    puck, find = among_protos
    node = find(name)

    assert puck.get("supervisor/node/get_type_name", node=node) == proto
    assert puck.get("supervisor/node/get_base_type_name", node=node) == base
    assert puck.get("supervisor/node/get_type", node=node) == number
    assert puck.get("supervisor/node/is_proto", node=node) is True


def test_a_proto_is_looked_into_only_through_an_instance(among_protos):
    """With `proto`, a client reads the inside of an instance; for other nodes it gets 0 or -1."""
    puck, find = among_protos
    number = "supervisor/node/get_number_of_fields"
    root = puck.get("supervisor/get_root")

    assert puck.get("supervisor/node/get_field", node=find("BOX"), fieldName="translation", proto=True) != 0
    assert puck.get("supervisor/node/get_field_by_index", node=find("BOX"), index=0, proto=True) != 0
    assert puck.get(number, node=find("BOX"), proto=True) > 0
    assert puck.get(number, node=root, proto=True) == -1
    assert find("BOX", proto=find("PUCK")) == find("BOX", proto=root) == 0


def test_ids_lead_back_to_nodes(robot, find):
    """A client may have only the number of a node, for example from a contact point."""
    number = robot.get("supervisor/node/get_id", node=find("TARGET"))

    assert robot.get("supervisor/get_from_id", id=number) == find("TARGET")
    assert robot.get("supervisor/get_from_id", id=10_000) == 0
    assert robot.get("supervisor/get_from_id", id=-1) == 0


def test_the_root_is_a_group_with_id_0(robot, find):
    """The root contains all nodes of the world and has no parent."""
    root = robot.get("supervisor/get_root")

    assert robot.get("supervisor/node/get_id", node=root) == 0
    assert robot.get("supervisor/node/get_type_name", node=root) == "Group"
    assert robot.get("supervisor/node/get_def", node=root) == ""
    assert robot.get("supervisor/node/get_parent_node", node=find("ROBOTINO")) == root
    assert robot.get("supervisor/node/get_parent_node", node=root) == 0


def test_self_is_the_robot_that_asks(robot, find):
    """In the built-in arena, the robot is its own supervisor."""
    assert robot.get("supervisor/get_self") == find("ROBOTINO")


def test_a_device_is_found_by_its_raw_name(robot):
    """The raw name contains blanks. For an unknown name the call fails."""
    handle = robot.get("supervisor/get_from_device", value="touch sensor")

    assert robot.get("supervisor/node/get_type_name", node=handle) == "TouchSensor"
    with pytest.raises(ServiceFailed, match="no device 'touch_sensor'"):
        robot.call("supervisor/get_from_device", value="touch_sensor")


def test_devices_of_other_robots_are_not_found(two_robots):
    """A controller can use only the devices of its own robot."""
    supervisor, _ = two_robots

    with pytest.raises(ServiceFailed, match="no device 'ir1'"):
        supervisor.call("supervisor/get_from_device", value="ir1")


@pytest.mark.parametrize("handle", [0, 1, 2**63, 0x5580_0000_0000])
def test_a_handle_that_is_none_fails(robot, handle):
    """As in Webots, the call fails for handle 0; other wrong handles may crash the real controller."""
    with pytest.raises(ServiceFailed, match="does not exist; get a new handle"):
        robot.call("supervisor/node/get_position", node=handle)


def test_the_handle_of_a_field_is_no_node(robot, find):
    """A client that confuses the handles of fields and nodes must get an error."""
    field = robot.get("supervisor/node/get_field", node=find("TARGET"), fieldName="translation")

    with pytest.raises(ServiceFailed, match=r"node .* does not exist"):
        robot.call("supervisor/node/get_position", node=field)
    with pytest.raises(ServiceFailed, match=r"field .* does not exist"):
        robot.call("supervisor/field/get_vec3f", field=find("TARGET"))


def test_positions_are_in_the_world(robot, position, drive):
    """A position is in the axes of the world, so that of a robot's part changes while the robot drives."""
    assert position(robot, "CYLINDER_2") == (-0.8, -0.8, 0.2)
    drive(robot, 0.1, 0.0, 0.0)

    robot.call("robot/time_step", value=3200)
    sensor = robot.get("supervisor/get_from_device", value="ir1")
    point = robot.get("supervisor/node/get_position", node=sensor)

    assert position(robot, "ROBOTINO") == pytest.approx((0.32, 0.0, 0.0))
    assert (point.x, point.y, point.z) == pytest.approx((0.32 + 0.2264, 0.0, 0.0566))


def test_orientations_are_quaternions(robot, find, drive):
    """A left turn is a rotation about +z."""
    drive(robot, 0.0, 0.0, 0.5)
    robot.call("robot/time_step", value=3200)

    turned = robot.get("supervisor/node/get_orientation", node=find("ROBOTINO"))

    assert (turned.x, turned.y) == (0.0, 0.0)
    assert 2 * math.atan2(turned.z, turned.w) == pytest.approx(1.6)


def test_the_velocity_is_in_world_axes(robot, find, drive):
    """After a quarter turn to the left, forward is +y of the world."""
    field = robot.get("supervisor/node/get_field", node=find("ROBOTINO"), fieldName="rotation")
    half = math.sqrt(0.5)
    robot.call("supervisor/field/set_rotation", field=field, value={"z": half, "w": half})
    drive(robot, 0.2, 0.0, 0.0)
    robot.call("robot/time_step", value=320)

    velocity = robot.get("supervisor/node/get_velocity", node=find("ROBOTINO"))

    assert (velocity.linear.x, velocity.linear.y) == pytest.approx((0.0, 0.2), abs=1e-6)
    assert velocity.angular.z == 0.0


def test_what_stands_has_no_velocity(robot, find):
    """A supervisor may request the velocity of any node with a frame, also of a fixed node."""
    velocity = robot.get("supervisor/node/get_velocity", node=find("TARGET"))

    assert (velocity.linear.x, velocity.linear.y, velocity.angular.z) == (0.0, 0.0, 0.0)


def test_a_velocity_can_be_set_and_fades(robot, find, position, drive):
    """The motors of the robot stop it within a few basic steps."""
    drive(robot, 0.0, 0.0, 0.0)
    velocity = {"linear": {"x": 1.0}}

    assert robot.get("supervisor/node/set_velocity", node=find("ROBOTINO"), velocity=velocity) == 1
    robot.call("robot/time_step", value=1920)

    moved = robot.get("supervisor/node/get_velocity", node=find("ROBOTINO"))
    assert position(robot, "ROBOTINO")[0] > 0.01
    assert moved.linear.x == 0.0


def test_a_node_without_a_place_has_no_position(robot, find):
    """Webots returns a null pointer, which crashes its controller."""
    with pytest.raises(ServiceFailed, match="a Cylinder has no position"):
        robot.call("supervisor/node/get_position", node=find("BODY"))


def test_get_pose_is_swapped_as_in_webots(robot, find):
    """As in Webots, the service returns `from_node` relative to `node`.

    A `from_node` of 0 crashes the real controller; here the call fails.
    """
    pose = robot.get("supervisor/node/get_pose", node=find("CYLINDER_2"), from_node=find("CYLINDER_0"))
    seen = (pose.translation.x, pose.translation.y, pose.translation.z)

    assert seen == pytest.approx((1.6, 1.6, 0.0))
    assert pose.rotation.w == 1.0
    with pytest.raises(ServiceFailed, match="does not exist"):
        robot.call("supervisor/node/get_pose", node=find("CYLINDER_2"), from_node=0)


def test_the_pose_of_a_part_is_constant_in_its_robot(robot, find, drive):
    """A client may read the pose of a sensor once, and use it for the whole run."""
    sensor = robot.get("supervisor/get_from_device", value="ir3")
    drive(robot, 0.1, 0.1, 0.5)
    robot.call("robot/time_step", value=1920)

    pose = robot.get("supervisor/node/get_pose", node=find("ROBOTINO"), from_node=sensor)

    assert (pose.translation.x, pose.translation.y) == pytest.approx((0.0393, 0.223))
    assert 2 * math.atan2(pose.rotation.z, pose.rotation.w) == pytest.approx(1.3963)


def test_fields_are_found_by_name_and_by_index(robot, find):
    """For a field that does not exist, the handle is 0."""
    target = find("TARGET")
    count = robot.get("supervisor/node/get_number_of_fields", node=target)
    handles = [
        robot.get("supervisor/node/get_field_by_index", node=target, index=index)
        for index in range(count + 1)
    ]
    names = [robot.get("supervisor/field/get_name", field=handle) for handle in handles[:-1]]

    assert names[:3] == ["translation", "rotation", "children"]
    assert handles[-1] == 0
    assert robot.get("supervisor/node/get_field", node=target, fieldName="rotation") == handles[1]
    assert robot.get("supervisor/node/get_field", node=target, fieldName="color") == 0
    assert robot.get("supervisor/node/get_field", node=target, fieldName="rotation", proto=True) == 0


def test_reset_physics_of_a_node_stops_it(robot, find, drive):
    """After the call, the robot accelerates from rest."""
    drive(robot, 2.0, 0.0, 0.0)
    robot.call("robot/time_step", value=320)

    assert robot.get("supervisor/node/reset_physics", node=find("ROBOTINO")) == 1

    velocity = robot.get("supervisor/node/get_velocity", node=find("ROBOTINO"))
    assert velocity.linear.x == 0.0


def test_a_node_can_be_exported_as_written(robot, find):
    """A client can import the exported text again, because it is that of the world file."""
    text = robot.get("supervisor/node/export_string", node=find("CYLINDER_0"))
    whole = robot.get("supervisor/node/export_string", node=robot.get("supervisor/get_root"))

    assert text.startswith("DEF CYLINDER_0 Solid {")
    assert text.endswith("}")
    assert whole == builtin("arena").decode()


def test_hints_are_taken(robot, find):
    """A client may call these services, which change only the speed of responses, or the rendering."""
    target = find("TARGET")

    assert robot.get("supervisor/node/enable_pose_tracking", node=target, sampling_period=32) == 1
    assert robot.get("supervisor/node/disable_pose_tracking", node=target) == 1
    assert robot.get("supervisor/node/set_visibility", node=target, visible=0) == 1
    assert robot.get("supervisor/node/move_viewpoint", node=target) == 1
    assert robot.get("supervisor/node/get_static_balance", node=target) == 1
    center = robot.get("supervisor/node/get_center_of_mass", node=target)
    assert (center.x, center.y) == (1.5, 0.0)


def test_a_used_node_is_a_node_of_its_own(robot, find):
    """A node that USE repeats has its own number; its DEF leads to the first one."""
    wall = find("WALL_0")
    field = robot.get("supervisor/node/get_field", node=wall, fieldName="boundingObject")

    used = robot.get("supervisor/field/get_node", field=field)

    assert used not in (0, find("WALL_0_BOX"))
    assert robot.get("supervisor/node/get_type_name", node=used) == "Box"


def test_what_hangs_on_a_joint_moves_with_it(ros, start, world, simple_robot):
    """The joint turns a quarter about x, so a point 1 m to the left moves to 1 m above."""
    arm = """HingeJoint { jointParameters HingeJointParameters { anchor 0 0 0.5 }
      device RotationalMotor { name "arm" }
      endPoint Solid { translation 0 0 0.5 children [ DEF HAND Pose { translation 0 1 0 } ] } }
      DEF IR"""
    start(world(robot=simple_robot.replace("DEF IR", arm, 1)))
    robot = ros.node("robotino")
    hand = robot.get("supervisor/get_from_def", name="HAND")

    robot.call("arm/set_position", value=math.pi / 2)
    robot.call("robot/time_step", value=3200)
    position = robot.get("supervisor/node/get_position", node=hand)

    assert (position.x, position.y, position.z) == pytest.approx((0.0, 0.0, 1.5), abs=1e-3)
