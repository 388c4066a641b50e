"""The stub refuses a world that it cannot simulate; the message names the line and the column."""

import pickle

import pytest

from palaestra_sim.errors import WorldError, WorldRefusedError
from tests.scenes import scene_of

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


def test_a_robot_with_a_body_inside_a_pose_is_refused(world, simple_robot):
    """The translation of such a robot would be in another frame than the floor."""
    with pytest.raises(WorldError, match="a robot that drives inside another node"):
        scene_of(world(robot=f"Pose {{ translation 1 0 0 children [ {simple_robot} ] }}"))


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
        "my.wbt:9:1: controllerArgs without --name=; add --name=NAME",
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


@pytest.mark.parametrize("step", ["0.5", "32.5", "0", "-32"])
def test_the_basic_step_is_whole_milliseconds(world, step):
    """The real controller uses only the integer part of the basic step as its divisor."""
    with pytest.raises(WorldError, match="not a whole number of milliseconds"):
        scene_of(world(info=f"basicTimeStep {step}"))


def test_errors_point_at_the_node(world):
    """A person finds the node by the line and the column, and reads the remedy."""
    with pytest.raises(WorldError) as caught:
        scene_of(world("Solid {\n  boundingObject Cone { }\n}"))

    assert str(caught.value) == (
        "my.wbt:4:18: the stub simulates no Cone as a boundingObject;"
        " leave it out (--leave-out), or run this world with driver webots"
    )
