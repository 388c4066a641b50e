"""The generator refuses a world with one line for each kind of mistake: position, fact and remedy."""

from collections.abc import Callable

import pytest

from tests.unit.world.robot_nodes import COMPLETE, robot


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "Solid { }",
            'my.wbt:1:1: the world has no robot; add one with controller "ros" and supervisor TRUE',
        ),
        (
            'Solid { }\nRobot { name "khepera" controller "braitenberg" } EPuck { controller "" } Robot { }',
            (
                'my.wbt:3:1: no robot has the controller "ros": there are'
                ' "khepera" (controller "braitenberg"), "EPuck" (controller "<generic>"),'
                ' "robot" (controller "<generic>");'
                ' set controller "ros" on the robots to be trained, and supervisor TRUE on one of them'
            ),
        ),
    ],
)
def test_a_world_without_a_robot_that_speaks_ros_is_refused_with_the_controllers_that_there_are(
    refusal: Callable[..., str], text: str, message: str
) -> None:
    """A training run would find no robot in this world."""
    assert refusal(text) == message


def test_all_refusals_of_a_world_come_at_once(refusal: Callable[..., str]) -> None:
    """A person corrects all mistakes of a world at once; the lines are in the order of the file."""
    text = 'EXTERNPROTO "a.proto"\n' + robot("controllerArgs 5") + "\n" + robot("") + "\n" + robot("")

    assert [line.partition(";")[0] for line in refusal(text).splitlines()] == [
        'my.wbt:2:13: "a.proto" is relative to the file of the world, and this world is not in a file',
        "my.wbt:3:57: 5 in controllerArgs is not a string",
        'my.wbt:4:1: a second robot is called "robotino" (2 places, in lines 4, 5)',
    ]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        pytest.param(
            f"DEF A {robot('')}\nUSE A",
            'my.wbt:3:1: USE A repeats the robot "robotino" and its ROS name; '
            "write the node out, with another name",
            id="a robot used again",
        ),
        pytest.param(
            f"DEF A Group {{ children [ {robot('')} ] }}\n  Group {{ children USE A }}",
            'my.wbt:3:20: USE A repeats the robot "robotino"',
            id="a group with a robot used again",
        ),
        pytest.param(
            robot("") + "\n" + robot(""),
            'my.wbt:3:1: a second robot is called "robotino"; give it another name',
            id="two robots of one name",
        ),
        pytest.param(
            robot("controllerArgs 5"),
            'my.wbt:2:57: 5 in controllerArgs is not a string; write a list like ["--clock"]',
            id="a number as an argument",
        ),
        pytest.param(
            robot('controllerArgs [ "--clock" Group { } ]'),
            "my.wbt:2:69: Group in controllerArgs is not a string",
            id="a node among the arguments",
        ),
        pytest.param(
            robot('controllerArgs [ "__name:=other" ]'),
            'my.wbt:2:59: "__name:=other" overrides the generated ROS name; remove it',
            id="a remapping of the node's name",
        ),
        pytest.param(
            'EXTERNPROTO "../protos/Lamp.proto"',
            'my.wbt:2:13: "../protos/Lamp.proto" is relative to the file of the world, '
            "and this world is not in a file; begin the address with webots:// or https://, or give",
            id="a relative PROTO",
        ),
        pytest.param(
            'ImageTexture {\n  url [ "https://a/b.png" "textures/c.png" ] }',
            'my.wbt:3:27: "textures/c.png" is relative to the file of the world',
            id="a relative texture",
        ),
        pytest.param(
            'Background { frontUrl "sky.jpg" }',
            'my.wbt:2:23: "sky.jpg" is relative to the file of the world',
            id="a relative sky",
        ),
        pytest.param(
            'Floor { texture "tiles.jpg" }',
            'my.wbt:2:17: "tiles.jpg" is relative to the file of the world',
            id="a relative texture of a PROTO",
        ),
    ],
)
def test_a_world_that_no_simulator_can_have_is_refused(
    refusal: Callable[..., str], text: str, message: str
) -> None:
    """A person finds the mistake by its position, and sees what to write instead."""
    with_robot = text if "controller" in text else text + COMPLETE
    assert refusal(with_robot).startswith(message)
