"""Worlds are read; rejections name the line and the column."""

import math
import pickle

import pytest

from palaestra_sim.errors import WorldError, WorldRefusedError
from palaestra_sim.scene.devices.distance_sensor import DISTANCE_SENSOR
from palaestra_sim.scene.reader import read_scene
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.scene.tree.scene_tree import SceneTree
from palaestra_sim.stub.outline import obstacle
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin, parse
from tests.scenes import load_scene


def scene_of(source):
    """Return the scene of a world file."""
    return read_scene(SceneTree(parse(source), "my.wbt"), StubPhysics())


def distance(simulation):
    """Return the distance that the noiseless front ray of the simple robot measures, in meters."""
    simulation.step(32)
    return 1.0 - simulation.robots[0].sensors["ir1"].value


def test_the_shipped_arena_is_read_whole():
    """The arena has four walls, a floor and four cylinders; its target is not an obstacle."""
    scene = scene_of(builtin("arena"))

    kinds = [shape.kind for shape in scene.solids]
    (robot,) = scene.robots

    assert kinds == ["box"] * 5 + ["cylinder"] * 4
    assert scene.basic_step_ms == 32
    assert robot.name == "robotino"
    assert robot.body.radius == pytest.approx(0.2286)
    assert len(robot.devices.of(DISTANCE_SENSOR)) == 9


def test_rays_sit_on_the_rim_and_count_counter_clockwise():
    """ir1 is at the front of the robot, and ir2 is at 40 degrees to the left."""
    (robot,) = scene_of(builtin("arena")).robots

    azimuths = [math.degrees(math.atan2(*it.beams[0].ray[:1:-1])) for it in robot.devices.of(DISTANCE_SENSOR)]

    assert azimuths == pytest.approx([0, 40, 80, 120, 160, -160, -120, -80, -40], abs=0.1)


def test_walls_stand_where_the_file_has_them():
    """The inner faces of the walls are 2 m from the center."""
    walls = scene_of(builtin("arena")).solids[1:5]

    assert [obstacle(wall).gap(0.0, 0.0) for wall in walls] == pytest.approx([2.0] * 4)


def test_a_robot_without_a_body_watches_only(world):
    """No robot collides with a separate supervisor, and no sensor sees it."""
    watcher = """Robot { name "eye" supervisor TRUE controller "ros"
      controllerArgs ["--name=eye" "--synchronize"] }"""
    simulation = load_scene(world(watcher))

    assert simulation.robots[0].body is None
    simulation.step(32)
    assert simulation.robots[1].body.touched == 0


@pytest.mark.parametrize("angle", [0.0, 0.5, math.pi / 2, -2.0])
def test_a_box_may_have_any_heading(world, angle):
    """The crate is 1 m ahead. By its heading, a face or a corner is nearest to the robot."""
    crate = f"""Solid {{ translation 1 0 0.15 rotation 0 0 1 {angle} name "crate"
      boundingObject Box {{ size 0.4 0.4 0.3 }} }}"""
    half = 0.2 / max(abs(math.cos(angle)), abs(math.sin(angle)))

    simulation = load_scene(world(crate))

    assert distance(simulation) == pytest.approx(0.8 - half, abs=1e-6)


def test_frames_inside_frames_are_followed(world):
    """Solids may be inside Group, Pose and Solid. A boundingObject may contain Pose and Shape."""
    nested = """Group { children [ Pose { translation 0 1 0 rotation 0 0 1 -1.5707963 children [
      Solid { name "post" translation 1 0.9 0 boundingObject Pose { translation 0 0 0.1 children [
        Shape { geometry Cylinder { radius 0.1 height 0.2 } } ] } } ] } ] }"""

    simulation = load_scene(world(nested))

    assert distance(simulation) == pytest.approx(0.6, abs=1e-6)


def test_a_use_is_the_last_def_before_it(world):
    """VRML defines USE in this way."""
    posts = """DEF POST Solid { translation 5 0 0.1 name "a"
        boundingObject DEF SHAPE Cylinder { radius 0.1 height 0.2 } }
      Solid { translation 1 0 0.1 name "b" boundingObject USE SHAPE }"""

    assert distance(load_scene(world(posts))) == pytest.approx(0.7)


@pytest.mark.parametrize(
    ("z", "height", "seen"),
    [
        (0.1, 0.2, True),  # a post on the floor
        (0.5, 0.2, False),  # a lamp above the ray
        (-0.1, 0.2, False),  # below the surface of the floor
        (0.2, 0.2, False),  # above the ray, but low enough to touch the robot's body
    ],
)
def test_a_ray_sees_what_is_at_its_height(world, z, height, seen):
    """The ray is 5 cm above the floor, so it meets only what is at that height."""
    post = f"""Solid {{ translation 1 0 {z} name "post"
      boundingObject Cylinder {{ radius 0.1 height {height} }} }}"""

    assert (distance(load_scene(world(post))) < 0.9) is seen


def test_what_is_drawn_only_is_neither_seen_nor_felt(world):
    """The target is a Shape without a boundingObject."""
    drawn = """Pose { translation 0.5 0 0 children [ Shape { geometry Cylinder { radius 0.2 } } ] }
      Solid { translation 0.5 0 0 name "ghost" children [ Shape { geometry Box { } } ] }
      Viewpoint { } Background { } DirectionalLight { }"""

    assert distance(load_scene(world(drawn))) == pytest.approx(1.0)


def test_two_robots_see_each_other(world, simple_robot):
    """Rays meet the body of the other robot at its current position."""
    second = simple_robot.replace("DEF ROBOTINO", "DEF OTHER").replace("robotino", "other")
    second = second.replace("Robot {", "Robot { translation 1 0 0 ", 1)
    simulation = load_scene(world(second))

    simulation.step(32)

    assert 1.0 - simulation.robots[1].sensors["ir1"].value == pytest.approx(0.6)
    assert simulation.robots[0].sensors["ir1"].value == pytest.approx(0.0)


def test_a_bumper_without_a_boundingobject_never_fires(world, simple_robot):
    """The bumper in the original PROTO of the Robotino 3 has no boundingObject."""
    bare = simple_robot.replace(
        '"touch sensor" boundingObject Cylinder { radius 0.2 height 0.2 }', '"touch sensor"'
    )
    wall = 'Solid { translation 0.15 0 0.15 name "wall" boundingObject Box { size 0.1 4 0.3 } }'
    simulation = load_scene(world(wall, robot=bare))

    simulation.step(32)

    assert simulation.robots[0].body.x < 0.0
    assert simulation.robots[0].sensors["touch sensor"].value is False


def test_an_obstacle_may_get_another_size(world):
    """A client that randomizes sizes must train in the worlds that it writes."""
    post = """Solid { translation 1 0 0.1 name "post" children [ Shape {
      geometry DEF SIZE Cylinder { radius 0.1 height 0.2 } } ] boundingObject USE SIZE }"""
    simulation = load_scene(world(post))
    assert distance(simulation) == pytest.approx(0.7)
    radius = simulation.tree.field_of(simulation.tree.of_def("SIZE"), "radius", simulation)

    radius.set(FieldType.FLOAT, 0, 0.3)
    assert distance(simulation) == pytest.approx(0.5)

    radius.set(FieldType.FLOAT, 0, -1.0)
    assert radius.get(FieldType.FLOAT) == 0.3
    simulation.reset()
    assert distance(simulation) == pytest.approx(0.5)  # as in Webots, a reset restores only poses


BAD = {
    "a PROTO": ("RectangleArena { }", "the stub simulates no RectangleArena"),
    "a loose crate": (
        'Solid { name "crate" physics Physics { } boundingObject Box { } }',
        "a Solid with physics moves when it is pushed",
    ),
    "a cone": ("Solid { boundingObject Cone { } }", "no Cone as a boundingObject"),
    "a tilted box": (
        "Solid { rotation 1 0 0 0.5 boundingObject Box { } }",
        "a Box that neither stands nor lies",
    ),
    "a slope": ("Solid { rotation 1 0 0 0.5 boundingObject Plane { } }", "a Plane that is neither a floor"),
    "a dangling USE": ("Solid { boundingObject USE NOTHING }", "USE NOTHING has no DEF before it"),
    "a malformed translation": ("Pose { translation 1 2 }", "Pose.translation is not 3 numbers"),
    "a place beyond all floats": (
        "Solid { translation 1e200 0 0 boundingObject Box { } }",
        r"Solid.translation has a number above 1e\+100",
    ),
    "a malformed radius": (
        'Solid { boundingObject Cylinder { radius "1" } }',
        "Cylinder.radius is not a number",
    ),
}


@pytest.mark.parametrize(("objects", "fact"), BAD.values(), ids=BAD.keys())
def test_what_cannot_be_simulated_is_refused(world, objects, fact):
    """The stub must not simulate something else in place of such a node."""
    with pytest.raises(WorldError, match=fact):
        scene_of(world(objects))


BAD_ROBOTS = {
    "an unknown part": (("DEF IR", "Minotaur { } DEF IR"), "the stub simulates no Minotaur on a robot"),
    "a leaning robot": (("Robot {", "Robot { rotation 1 0 0 0.3"), "does not stand upright"),
    "an odd type": (('name "ir1"', 'name "ir1" type "radar"'), "'radar' is not a type of distance sensor"),
    "a broken table": (("[ 0 1 0,", "[ 0 1,"), "lookupTable does not have rows of three numbers"),
    "an unsorted table": (("[ 0 1 0,", "[ 2 1 0,"), "the distances of lookupTable do not increase"),
    "a force sensor": (
        ('"touch sensor"', '"touch sensor" type "force"'),
        "a touch sensor that measures force",
    ),
    "two devices of a name": (('"ir1"', '"touch sensor"'), "a second device 'touch sensor'"),
    "a name that ROS refuses": (('"ir1"', '"ir::1"'), "a device 'ir::1', whose name ROS does not accept"),
    "two names of one topic": (
        ('"ir1"', '"touch-sensor"'),
        "devices 'touch-sensor' and 'touch sensor', whose topics are both 'touch_sensor'",
    ),
    "an axis of no length": (
        ("DEF IR", "HingeJoint { jointParameters HingeJointParameters { axis 0 0 0 } } DEF IR"),
        "a joint with an axis of length 0",
    ),
    "a ball joint with devices": (
        ("DEF IR", "BallJoint { device [ RotationalMotor { } ] } DEF IR"),
        "the stub simulates no BallJoint with devices",
    ),
}


@pytest.mark.parametrize(("change", "fact"), BAD_ROBOTS.values(), ids=BAD_ROBOTS.keys())
def test_a_robot_that_cannot_be_simulated_is_refused(world, simple_robot, change, fact):
    """The message names the part of the robot that the stub cannot simulate."""
    source = world(robot=simple_robot.replace(*change, 1 if "HingeJoint" in change[0] else -1))
    assert source != world()

    with pytest.raises(WorldError, match=fact):
        scene_of(source)


@pytest.mark.parametrize(
    ("rays", "seen"),
    [
        ("rotation 0 1 0 0.5", 0.05 / math.sin(0.5)),  # the ray ends at the floor
        ("rotation 0 1 0 1.5707963", 0.05),
        ("rotation 0 1 0 -0.5", 1.0),  # the ray passes above the wall
        ("rotation 0 1 0 -0.05", 0.65 / math.cos(0.05)),
    ],
)
def test_a_ray_may_look_up_and_down(world, simple_robot, rays, seen):
    """The ray starts 5 cm above the floor; the wall is 0.65 m ahead and 0.2 m high."""
    wall = 'Solid { translation 0.9 0 0.1 name "wall" boundingObject Box { size 0.1 4 0.2 } }'
    tilted = simple_robot.replace("DEF IR DistanceSensor {", f"DistanceSensor {{ {rays}")

    assert distance(load_scene(world(wall, robot=tilted))) == pytest.approx(seen, rel=1e-6)


WATCHER = """Robot {{ translation 0 0 1 rotation {rotation} name "tower" controller "ros"
  controllerArgs [ "--name=tower" "--synchronize" ] boundingObject Sphere {{ radius 0.1 }}
  children [ DistanceSensor {{ translation 0.2 0 0 name "ir1" lookupTable [ 0 0 0, 9 9 0 ] }} ] }}"""


@pytest.mark.parametrize(
    ("rotation", "seen"),
    [
        ("0 1 0 0", 1.8),
        ("0 1 0 0.25", 2.0 / math.cos(0.25) - 0.2),
        ("0 1 0 0.8", 1.0 / math.sin(0.8) - 0.2),  # the ray ends at the floor
        ("0 1 0 1.5707963", 0.8),
        ("0 1 0 -0.8", 9.0),  # the ray passes above the wall
        ("1 0 0 1.2", 1.8),  # a rotation about the ray itself
        ("0.5773503 0.5773503 0.5773503 2.0943951", 9.0),  # the robot's x axis is y of the world
        ("0 0 1 0.4", 2.0 / math.cos(0.4) - 0.2),
    ],
)
def test_a_robot_that_leans_sees_along_its_own_axes(rotation, seen):
    """The robot has no wheels.

    It is 1 m above the floor and 2 m from a wall, and its ray passes its own shape.
    """
    wall = "Solid { translation 2.05 0 1 boundingObject Box { size 0.1 9 2 } }"
    text = f"#VRML_SIM R2023b utf8\nWorldInfo {{ }} {wall} {WATCHER.format(rotation=rotation)}"

    simulation = load_scene(text.encode())
    simulation.step(32)

    assert simulation.robots[0].sensors["ir1"].value == pytest.approx(seen, abs=1e-5)


@pytest.mark.parametrize("count", range(1, 31))
def test_several_rays_are_a_cone_that_is_symmetric_about_its_axis(world, simple_robot, count):
    """In front of a wall, a sonar measures along its axis, or along the ray nearest to the axis."""
    sonar = simple_robot.replace('name "ir1"', f'name "ir1" type "sonar" numberOfRays {count} aperture 0.2')
    wall = 'Solid { translation 0.55 0 0.3 name "wall" boundingObject Box { size 0.1 4 2 } }'

    measured = distance(load_scene(world(wall, robot=sonar)))

    assert 0.3 - 1e-9 <= measured <= 0.3 / math.cos(0.1) + 1e-9


def test_rays_off_the_axis_count_less(world, simple_robot):
    """Of five rays at a thin post, the ray ahead and the upper ray meet the post.

    The lower ray meets the floor, and the two side rays meet nothing within 1 m.
    """
    cone = simple_robot.replace('name "ir1"', 'name "ir1" numberOfRays 5 aperture 0.4 gaussianWidth 0.5')
    post = "Solid { translation 0.6 0 0.1 boundingObject Cylinder { radius 0.01 height 0.2 } }"
    weight = math.exp(-1.0)  # the ray is 0.2 rad off the axis; the width is 0.4 * 0.5

    measured = distance(load_scene(world(post, robot=cone)))

    above, below, aside = 0.39 / math.cos(0.2), 0.05 / math.sin(0.2), 1.0
    expected = (0.39 + weight * (above + below + 2 * aside)) / (1 + 4 * weight)
    assert measured == pytest.approx(expected, rel=1e-6)


def test_a_robot_with_a_body_inside_a_pose_is_refused(world, simple_robot):
    """The translation of such a robot would be in another frame than the floor."""
    with pytest.raises(WorldError, match="a robot that drives inside another node"):
        scene_of(world(robot=f"Pose {{ translation 1 0 0 children [ {simple_robot} ] }}"))


def test_a_robot_may_have_its_parts_in_groups_and_its_table_from_the_default(world, simple_robot):
    """A sensor inside a Group is found. Without a table, Webots' default of 0 to 1000 over 10 cm applies."""
    part = 'Group { children [ DistanceSensor { translation 0.2 0 0.05 name "near" } ] }'
    wall = 'Solid { translation 0.3 0 0.15 name "wall" boundingObject Box { size 0.1 4 0.3 } }'
    simulation = load_scene(world(wall, robot=simple_robot.replace("DEF IR", f"{part} DEF IR")))
    simulation.robots[0].body.place(0.0, 0.0, 0.0)

    simulation.step(32)

    assert simulation.robots[0].sensors["near"].value == pytest.approx(500.0)


def test_a_robot_without_a_body_may_have_rays(world):
    """A light barrier is such a robot; it stays at the pose of the world file."""
    barrier = """Robot { name "barrier" translation 0 1 0 rotation 0 0 1 -1.5707963 children [
      DistanceSensor { translation 0 0 0.1 name "beam" lookupTable [ 0 0 0, 5 5 0 ] } ] }"""
    simulation = load_scene(world(robot=barrier))
    simulation.step(32)
    assert simulation.robots[0].sensors["beam"].value == pytest.approx(5.0)

    post = "Solid { translation 0 0 0.1 boundingObject Cylinder { radius 0.2 height 0.2 } }"
    simulation = load_scene(world(post, robot=barrier))
    simulation.step(32)

    assert simulation.robots[0].sensors["beam"].value == pytest.approx(0.8)


def test_a_joint_without_a_motor_stays_where_it_is(world, simple_robot):
    """The joint does not move, so its sensor reads 0."""
    joint = 'HingeJoint { device [ PositionSensor { name "hinge" } ] }'
    simulation = load_scene(world(robot=simple_robot.replace("DEF IR", f"{joint} DEF IR")))

    simulation.step(32)

    assert simulation.robots[0].sensors["hinge"].value == 0.0


def test_a_position_sensor_may_be_coarse_and_noisy(world, simple_robot):
    """The noise in radians is added before the value is rounded to multiples of `resolution`."""
    coarse = simple_robot.replace(
        'PositionSensor { name "wheel0_joint_sensor" }',
        'PositionSensor { name "wheel0_joint_sensor" resolution 0.25 noise 0.5 }',
    )
    simulation = load_scene(world(robot=coarse))
    values = set()

    for _ in range(50):
        simulation.step(32)
        values.add(simulation.robots[0].sensors["wheel0_joint_sensor"].value)

    assert len(values) > 3
    assert all(value % 0.25 == 0.0 for value in values)


def test_all_that_is_refused_comes_in_one_message_with_a_line_for_each_kind_and_all_places(world):
    """A person can correct all mistakes of a world at once, and not one after each start."""
    robot = """Robot { name "r" controller "ros"
      children [ Theseus { } Minotaur { } ] }"""
    ball = "Solid { physics Physics { }\nboundingObject Cone { } }"
    objects = f"Floor {{ }}\nTree {{ }}\nTree {{ }}\n{ball}\nTree {{ }}"
    with pytest.raises(WorldRefusedError) as caught:
        scene_of(world(objects, robot))

    elsewhere = "leave it out (--leave-out), or run this world with driver webots"
    assert str(caught.value).splitlines() == [
        f"my.wbt:3:1: the stub simulates no Floor; {elsewhere}",
        f"my.wbt:4:1: the stub simulates no Tree (3 places, in lines 4, 5, 8); {elsewhere}",
        (
            "my.wbt:6:1: a Solid with physics moves when it is pushed, which the stub does not simulate;"
            f" remove physics, {elsewhere}"
        ),
        f"my.wbt:7:16: the stub simulates no Cone as a boundingObject; {elsewhere}",
        "my.wbt:9:1: controllerArgs without --name=; generate the world",
        "my.wbt:9:1: controllerArgs without --synchronize: the stub steps only on request; add it",
        f"my.wbt:10:18: the stub simulates no Theseus on a robot; {elsewhere}",
        f"my.wbt:10:30: the stub simulates no Minotaur on a robot; {elsewhere}",
    ]
    assert caught.value.line == 3
    assert len(caught.value.errors) == 10


def test_a_refusal_of_several_things_survives_a_copy(world):
    """A process pool pickles the error, so that it reaches the parent."""
    with pytest.raises(WorldRefusedError) as caught:
        scene_of(world("Floor { }\nTree { }"))

    assert str(pickle.loads(pickle.dumps(caught.value))) == str(caught.value)


def test_a_shape_that_is_used_twice_is_refused_once(world):
    """The shape has one position in the file, so the message has one line about it."""
    objects = """Solid { boundingObject DEF BALL Cone { } }
      Solid { boundingObject USE BALL }"""

    with pytest.raises(WorldError) as caught:
        scene_of(world(objects))

    assert not isinstance(caught.value, WorldRefusedError)


def test_a_wheel_may_have_an_outline_and_free_rollers(world, simple_robot):
    """The stub's floor is flat, and a wheel touches nothing else. So its outline has no effect."""
    roller = "HingeJoint { endPoint Solid { boundingObject Cylinder { radius 0.01 height 0.01 } } }"
    wheel = f"endPoint DEF WHEEL Solid {{ children [ {roller} ] "

    scene = scene_of(world(robot=simple_robot.replace("endPoint Solid {", wheel, 1)))

    assert scene.robots[0].body.radius == pytest.approx(0.2)


@pytest.mark.parametrize("step", ["0.5", "32.5", "0", "-32"])
def test_the_basic_step_is_whole_milliseconds(world, step):
    """The real controller uses only the integer part of the basic step as its divisor."""
    with pytest.raises(WorldError, match="not a whole number of milliseconds"):
        scene_of(world(info=f"basicTimeStep {step}"))


def test_errors_point_at_the_node(world):
    """The message has the line, the column and the remedy."""
    with pytest.raises(WorldError) as caught:
        scene_of(world("Solid {\n  boundingObject Cone { }\n}"))

    assert str(caught.value) == (
        "my.wbt:4:18: the stub simulates no Cone as a boundingObject;"
        " leave it out (--leave-out), or run this world with driver webots"
    )
