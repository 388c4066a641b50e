"""Worlds that change at run time: nodes are added and removed, states are saved, and joints are moved."""

import math

import pytest

from palaestra_sim.ros.node import ServiceFailed

WALL = 'DEF WALL Solid { translation 1.3 0.5 0.5 boundingObject Box { size 0.1 4 1 } name "wall" }'
STEP_MS = 32


@pytest.fixture
def children(robot):
    """Return the handle of the root's field `children`."""
    root = robot.get("supervisor/get_root")
    return robot.get("supervisor/node/get_field", node=root, fieldName="children")


@pytest.fixture
def add(robot, children):
    """`add(text, position)` imports nodes into the root's children and returns the response."""

    def call(text, position=-1, field=None):
        return robot.get(
            "supervisor/field/import_node_from_string",
            field=children if field is None else field,
            position=position,
            nodeString=text,
        )

    return call


@pytest.fixture
def find(robot):
    """`find("WALL")` returns the handle of a node by its DEF."""
    return lambda name: robot.get("supervisor/get_from_def", name=name)


def count(robot, field):
    """Return the number of values in a field."""
    return robot.get("supervisor/field/get_count", field=field)


def test_an_added_node_is_found_and_counts_at_once(robot, children, add, find):
    """As in Webots, the node is found even while the simulation is paused."""
    before = count(robot, children)

    assert add(WALL) == 1
    assert count(robot, children) == before + 1
    wall = find("WALL")
    assert robot.get("supervisor/field/get_node", field=children, index=-1) == wall
    assert robot.get("supervisor/node/get_parent_node", node=wall) == robot.get("supervisor/get_root")
    assert robot.get("supervisor/node/get_position", node=wall) == (1.3, 0.5, 0.5)
    assert "DEF WALL" in robot.get("supervisor/node/export_string", node=wall)


def test_several_nodes_are_added_in_their_order_before_the_position(robot, children, add, find):
    """Positions count from 0 at the start of the field, and from -1 at its end."""
    assert add("DEF A Group { } DEF B Group { }", position=1) == 1

    assert robot.get("supervisor/field/get_node", field=children, index=1) == find("A")
    assert robot.get("supervisor/field/get_node", field=children, index=2) == find("B")


def test_an_added_solid_is_an_obstacle_until_it_is_removed(start, ros):
    """A policy must see the new obstacle with the next step, and must not see a removed obstacle."""
    simulation = start().simulation
    (robot,) = simulation.robots
    node = ros.node("robotino")
    simulation.step(STEP_MS)
    ahead = robot.sensors["ir1"].value
    x, y, _ = robot.place.translation
    sensor = node.get("supervisor/get_from_device", value="ir1")
    at = node.get("supervisor/node/get_position", node=sensor)
    away = math.atan2(at.y - y, at.x - x)
    root = node.get("supervisor/get_root")
    field = node.get("supervisor/node/get_field", node=root, fieldName="children")
    post = f"DEF POST Solid {{ translation {x + 0.4 * math.cos(away)} {y + 0.4 * math.sin(away)} 0.5"
    post += " boundingObject Cylinder { radius 0.05 height 1 } }"

    node.get("supervisor/field/import_node_from_string", field=field, position=-1, nodeString=post)
    simulation.step(STEP_MS)
    assert robot.sensors["ir1"].value != pytest.approx(ahead, abs=0.02)

    node.get("supervisor/node/remove", node=node.get("supervisor/get_from_def", name="POST"))
    simulation.step(STEP_MS)
    assert robot.sensors["ir1"].value == pytest.approx(ahead, abs=0.02)


def test_a_removed_node_is_gone_with_its_handle_and_its_number(robot, children, add, find):
    """In Webots the client would keep a dangling pointer; here a call with the old handle fails."""
    add("DEF OUTER Pose { children [ DEF INNER Solid { } ] }")
    outer, inner = find("OUTER"), find("INNER")
    number = robot.get("supervisor/node/get_id", node=inner)
    before = count(robot, children)

    assert robot.get("supervisor/node/remove", node=outer) == 1
    assert count(robot, children) == before - 1
    assert (find("OUTER"), find("INNER")) == (0, 0)
    assert robot.get("supervisor/get_from_id", id=number) == 0
    for handle in (outer, inner):
        with pytest.raises(ServiceFailed, match="does not exist; get a new handle"):
            robot.get("supervisor/node/get_position", node=handle)


@pytest.mark.parametrize("service", ["remove_node", "remove"])
def test_a_node_is_removed_by_its_place_in_a_field(robot, children, add, find, service):
    """The service `remove` removes nodes too, as `wb_supervisor_field_remove_mf` does."""
    add(WALL)
    index = "position" if service == "remove_node" else "index"

    assert robot.get(f"supervisor/field/{service}", field=children, **{index: -1}) == 1
    assert find("WALL") == 0
    assert robot.get(f"supervisor/field/{service}", field=children, **{index: 999}) == 0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Solid {", "node:1"),
        ("Solid { boundingObject Colosseum { } }", "Colosseum"),
        ("Solid { physics Physics { } }", "with physics"),
        ("Solid { translation 1 }", "not 3 numbers"),
        ("USE NOTHING", "USE NOTHING has no DEF"),
        ('Robot { controller "ros" }', "controller ros"),
    ],
)
def test_what_cannot_be_added_fails_and_changes_nothing(robot, children, add, text, message):
    """If one node of the text is wrong, no node is added; the message has the position of the mistake."""
    before = count(robot, children)

    with pytest.raises(ServiceFailed, match=message):
        add(f"DEF FIRST Group {{ }} {text}")
    assert count(robot, children) == before
    assert robot.get("supervisor/get_from_def", name="FIRST") == 0


def test_a_place_that_the_field_does_not_have_answers_no_success(robot, children, add):
    """A client that checks only the response must notice that no node was added."""
    own = robot.get("supervisor/get_self")
    numbers = robot.get("supervisor/node/get_field", node=own, fieldName="translation")
    before = count(robot, children)

    assert [add(WALL, position=at) for at in (999, -999)] == [0, 0]
    assert add(WALL, position=0, field=numbers) == 0
    assert count(robot, children) == before


CRATE = """DEF CRATE Solid { translation 1.3 0.5 0.5 name "crate"
  children DEF AGAIN Group { }
  boundingObject DEF OUTLINE Group { children [ Box { } ] }
} Group { children USE AGAIN } DEF BARE Solid { name "bare" }"""
ACTING = 'Solid { name "new" boundingObject Box { } }'
DRAWN = "Shape { geometry Sphere { } }"


@pytest.mark.parametrize(
    ("place", "text", "message"),
    [
        ("OUTLINE.children", "Box { }", "Group.children, which is part of a boundingObject"),
        ("AGAIN.children", DRAWN, r"Group.children, which is used several times \(USE\)"),
        ("ROBOTINO.children", ACTING, "a Solid that affects the simulation cannot be added to a robot"),
        (
            "BARE.physics",
            "Physics { }",
            "a Physics that affects the simulation cannot be added to Solid.physics",
        ),
        ("BARE.boundingObject", "Box { }", "a Box that .* cannot be added to Solid.boundingObject"),
    ],
)
def test_a_node_without_effect_where_it_is_added_is_refused(robot, add, find, place, text, message):
    """If the call succeeded, the client would believe in an obstacle that no sensor sees."""
    add(CRATE)
    node, _, field = place.partition(".")
    target = robot.get("supervisor/node/get_field", node=find(node), fieldName=field)
    before = robot.get("supervisor/node/export_string", node=find(node))

    with pytest.raises(ServiceFailed, match=f"{message}.*change the world file, or use driver webots"):
        add(text, field=target)
    assert robot.get("supervisor/node/export_string", node=find(node)) == before


def test_a_drawn_node_may_be_added_to_a_robot(robot, add, find):
    """A task marks the robot that has to move; the mark only changes the pictures of cameras."""
    field = robot.get("supervisor/node/get_field", node=find("ROBOTINO"), fieldName="children")
    before = count(robot, field)

    assert add(DRAWN, field=field) == 1
    assert count(robot, field) == before + 1


def test_nodes_that_every_world_needs_and_parts_of_outlines_stay(robot, add, find):
    """The simulation reads these nodes once, at the start, so a removal would have no effect."""
    add(CRATE)
    root = robot.get("supervisor/get_root")
    outline = robot.get("supervisor/node/get_field", node=find("OUTLINE"), fieldName="children")

    with pytest.raises(ServiceFailed, match="the Group of a world cannot be removed; keep it"):
        robot.get("supervisor/node/remove", node=root)
    with pytest.raises(ServiceFailed, match="no part of a boundingObject can be removed"):
        robot.get("supervisor/field/remove_node", field=outline, position=0)
    assert count(robot, outline) == 1


def test_a_wheel_of_a_robot_cannot_be_removed_and_its_mark_can(robot, find):
    """The first two nodes of the robot are drawn, and the third is the joint of a wheel."""
    parts = robot.get("supervisor/node/get_field", node=find("ROBOTINO"), fieldName="children")
    before = count(robot, parts)

    with pytest.raises(
        ServiceFailed, match="a HingeJoint that affects the simulation cannot be removed from"
    ):
        robot.get("supervisor/field/remove_node", field=parts, position=2)
    assert robot.get("supervisor/field/remove_node", field=parts, position=1) == 1
    assert count(robot, parts) == before - 1


def test_a_running_robot_and_its_parts_cannot_be_removed(robot, find):
    """If the call succeeded, the client would believe that the part is gone."""
    for name in ("ROBOTINO", "BODY"):
        with pytest.raises(ServiceFailed, match="remove"):
            robot.get("supervisor/node/remove", node=find(name))


def test_a_reset_removes_what_was_added_and_brings_nothing_back(start, ros):
    """As in Webots, a reset does not restore a node that a client has removed."""
    simulation = start().simulation
    node = ros.node("robotino")
    root = node.get("supervisor/get_root")
    field = node.get("supervisor/node/get_field", node=root, fieldName="children")
    node.get("supervisor/node/remove", node=node.get("supervisor/get_from_def", name="CYLINDER_0"))
    node.get("supervisor/field/import_node_from_string", field=field, position=-1, nodeString=WALL)

    node.get("supervisor/simulation_reset")
    simulation.step(STEP_MS)

    assert node.get("supervisor/get_from_def", name="WALL") == 0
    assert node.get("supervisor/get_from_def", name="CYLINDER_0") == 0


def test_a_state_holds_a_node_and_all_inside_it(start, ros):
    """Loading a state puts the robot back at rest; the state `__init__` is its start in the world file."""
    simulation = start().simulation
    (robot,) = simulation.robots
    node = ros.node("robotino")
    handle = node.get("supervisor/get_self")
    begin = robot.place.translation
    for motor in robot.motors.values():
        motor.set_position(math.inf)
        motor.set_velocity(1.0 if motor.name == "wheel0_joint" else -0.5)
    simulation.step(10 * STEP_MS)
    there = (robot.place.translation, robot.place.rotation)
    assert node.get("supervisor/node/save_state", node=handle, state_name="there") == 1
    simulation.step(10 * STEP_MS)
    assert (robot.place.translation, robot.place.rotation) != there

    assert node.get("supervisor/node/load_state", node=handle, state_name="there") == 1
    assert (robot.place.translation, robot.place.rotation) == there
    assert robot.body.velocity == (0.0, 0.0, 0.0)
    node.get("supervisor/node/load_state", node=handle, state_name="__init__")
    assert robot.place.translation == begin
    with pytest.raises(ServiceFailed, match="has no state 'nowhere'; save it first"):
        node.get("supervisor/node/load_state", node=handle, state_name="nowhere")


def test_a_joint_is_put_to_a_position_and_its_motor_holds_it(start, ros, world, simple_robot):
    """As in Webots, the call also sets the target of the joint's motor."""
    arm = """DEF ARM SliderJoint { jointParameters JointParameters { axis 0 0 1 minStop 0 maxStop 0.2 }
      device [ PositionSensor { name "height" } LinearMotor { name "lift" } ] endPoint Solid { } }"""
    simulation = start(world(robot=simple_robot.replace("DEF IR", f"{arm} DEF IR"))).simulation
    (robot,) = simulation.robots
    node = ros.node("robotino")
    joint = node.get("supervisor/get_from_def", name="ARM")

    assert node.get("supervisor/node/set_joint_position", node=joint, position=0.1, index=1) is True
    simulation.step(10 * STEP_MS)
    assert robot.sensors["height"].value == 0.1
    node.get("supervisor/node/set_joint_position", node=joint, position=9.0, index=1)
    assert robot.motors["lift"].angle_rad == 0.2
    with pytest.raises(ServiceFailed, match="no axis 2"):
        node.get("supervisor/node/set_joint_position", node=joint, position=0.1, index=2)
    with pytest.raises(ServiceFailed, match="a Robot has no joint position"):
        node.get(
            "supervisor/node/set_joint_position",
            node=node.get("supervisor/get_self"),
            position=0.1,
            index=1,
        )


def test_the_sensor_of_a_joint_without_a_motor_measures_where_it_is_put(start, ros, world, simple_robot):
    """Nothing else moves such a joint, so it stays where the world file or a client puts it."""
    flap = """DEF FLAP HingeJoint { jointParameters HingeJointParameters { position 0.25 }
      device [ PositionSensor { name "angle" } ] endPoint Solid { } }"""
    simulation = start(world(robot=simple_robot.replace("DEF IR", f"{flap} DEF IR"))).simulation
    sensor = simulation.robots[0].sensors["angle"]
    node = ros.node("robotino")
    simulation.step(STEP_MS)
    assert sensor.value == 0.25

    joint = node.get("supervisor/get_from_def", name="FLAP")
    node.get("supervisor/node/set_joint_position", node=joint, position=0.6, index=1)
    simulation.step(STEP_MS)

    assert sensor.value == 0.6


def test_a_robot_that_stands_at_a_wall_has_a_contact_point_there(start, ros):
    """Robot and wall have the same contact points, each with the number of its own Solid."""
    simulation = start().simulation
    (robot,) = simulation.robots
    node = ros.node("robotino")
    own, root = node.get("supervisor/get_self"), node.get("supervisor/get_root")
    children = node.get("supervisor/node/get_field", node=root, fieldName="children")
    importing = "supervisor/field/import_node_from_string"
    node.get(importing, field=children, position=-1, nodeString=WALL)
    wall = node.get("supervisor/get_from_def", name="WALL")
    assert points(node, own) == []

    robot.place.translation = (1.3 - 0.05 - robot.body.radius + 0.01, 0.5, 0.0)
    simulation.step(STEP_MS)

    of_robot, of_wall = points(node, own), points(node, wall)
    number = node.get("supervisor/node/get_id", node=wall)
    assert {it.point for it in of_robot} >= {it.point for it in of_wall} != set()
    assert [it.point.x for it in of_wall] == pytest.approx([1.25] * len(of_wall))
    assert {it.node_id for it in of_wall} == {number}
    assert number not in {it.node_id for it in of_robot}


def test_two_robots_that_touch_have_the_same_contact_points(start, world, simple_robot):
    """A client reads a contact with another robot in the same way as a contact with a wall."""
    other = simple_robot.replace('name "robotino"', 'name "other"').replace("DEF ", "DEF OTHER_")
    moved = other.replace("Robot {", "Robot { translation 0 0 9", 1)
    first, second = (simulation := start(world=world(robot=simple_robot + moved)).simulation).robots
    assert list(simulation.contact_points(first.parts.node, descendants=True)) == []
    x, y, z = first.place.translation
    reach = first.body.radius + second.body.radius

    second.place.translation = (x + reach - 0.001, y, z)

    of_first = simulation.contact_points(first.parts.node, descendants=True)
    of_second = simulation.contact_points(second.parts.node, descendants=True)
    assert {point for point, _ in of_first} == {point for point, _ in of_second} != set()
    for point, _ in of_first:
        assert math.dist(point[:2], (x + first.body.radius, y)) < 0.05


def points(node, handle):
    """Return the contact points of a node and of its descendants."""
    asked = {"node": handle, "include_descendants": True}
    return node.get("supervisor/node/get_contact_points", **asked)
