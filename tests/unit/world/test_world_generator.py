"""The changes that the generator makes to a world, for each way of writing a robot.

An example is a world before and after. `NAME` stands for the generated name.
"""

from collections.abc import Callable

import pytest

from palaestra_sim.world import RunIdentity, WorldError, WorldRobot, generate, rename, robots, ros_name
from tests.unit.world.robot_nodes import COMPLETE, robot

Make = Callable[[str], bytes]


@pytest.fixture
def generated(world: Make, identity: RunIdentity) -> Callable[..., str]:
    """Return a function that generates from the text of a world and puts NAME for the generated names."""

    def make(text: str, robot: str = "robotino", *, clock: bool = True) -> str:
        made = generate(world(text), identity, clock=clock)
        assert generate(made, identity, clock=clock) == made
        return made.decode().split("\n", 1)[1].replace(ros_name(identity, robot), "NAME")

    return make


@pytest.mark.parametrize(
    ("before", "after"),
    [
        pytest.param(
            'controllerArgs ["--name=a" "--synchronize"]',
            'controllerArgs ["--name=NAME" "--synchronize"]',
            id="a name is replaced",
        ),
        pytest.param(
            'controllerArgs ["--name=a"]',
            'controllerArgs ["--name=NAME" "--synchronize"]',
            id="synchronize follows the name",
        ),
        pytest.param(
            'controllerArgs ["--auto-publish"]',
            'controllerArgs ["--name=NAME" "--synchronize" "--auto-publish"]',
            id="a missing name comes first",
        ),
        pytest.param(
            'controllerArgs [ "--synchronize", "--auto-publish" ]',
            'controllerArgs [ "--name=NAME" "--synchronize", "--auto-publish" ]',
            id="commas and blanks stay",
        ),
        pytest.param(
            "controllerArgs []",
            'controllerArgs ["--name=NAME" "--synchronize"]',
            id="an empty list is filled",
        ),
        pytest.param(
            'controllerArgs ["--name=a" "--name=b" "--synchronize"]',
            'controllerArgs ["--name=NAME" "--synchronize"]',
            id="a second name goes",
        ),
        pytest.param(
            'controllerArgs ["--auto-publish" "--name=a"]',
            'controllerArgs ["--auto-publish" "--name=NAME" "--synchronize"]',
            id="nothing is reordered",
        ),
        pytest.param(
            'controllerArgs "--name=a"',
            'controllerArgs ["--name=NAME" "--synchronize"]',
            id="a bare string becomes a list",
        ),
        pytest.param(
            'controllerArgs "--name=a --clock --robot-description=x"',
            'controllerArgs ["--name=NAME" "--synchronize" "--clock" "--robot-description=x"]',
            id="a bare string of several options becomes one string each",
        ),
        pytest.param(
            'controllerArgs ["--name=a --clock"]',
            'controllerArgs ["--name=NAME" "--synchronize" "--clock"]',
            id="so does one in a list, whose name would be 'a --clock'",
        ),
        pytest.param(
            'controllerArgs ["--name=my robot"]',
            'controllerArgs ["--name=NAME" "--synchronize"]',
            id="a name with a blank is one name",
        ),
        pytest.param(
            'controllerArgs ""',
            'controllerArgs ["--name=NAME" "--synchronize"]',
            id="an empty bare string is no argument",
        ),
        pytest.param(
            r'controllerArgs ["a\b \"c\""]',
            r'controllerArgs ["--name=NAME" "--synchronize" "a\b \"c\""]',
            id="kept arguments stay as written",
        ),
        pytest.param(
            'customData "--clock"',
            'controllerArgs ["--name=NAME" "--synchronize"] customData "--clock"',
            id="missing arguments go behind the controller",
        ),
    ],
)
def test_the_arguments_of_a_robot(generated: Callable[..., str], before: str, after: str) -> None:
    """Only the text from `controllerArgs` to its end changes."""
    assert generated(robot(before)) == robot(after)


def test_lines_and_comments_stay_where_they_are(generated: Callable[..., str]) -> None:
    """People compare a generated world with its source."""
    before = """Robot {
  name "robotino"  # the one and only
  controllerArgs [
    # who
    "--auto-publish"  # all of them

    "--name=a"  # I
  ]
  controller "ros"
}
"""

    assert generated(before) == before.replace('--name=a"', '--name=NAME" "--synchronize"')


def test_added_strings_are_on_lines_of_their_own_in_a_list_that_is(
    generated: Callable[..., str],
) -> None:
    """Webots would save the list in the same form, with the line ends of the file."""
    text = 'Robot {{\r\n  name "robotino"\r\n  controller "ros"\r\n  controllerArgs [{}\r\n  ]\r\n}}\r\n'
    before = text.format('\r\n    "--name=a"')
    after = text.format('\r\n    "--name=NAME"\r\n    "--synchronize"')

    assert generated(before) == after


def test_an_added_list_is_on_lines_of_its_own_if_the_controller_is(
    generated: Callable[..., str],
) -> None:
    """The new lines have the indentation of the robot's other fields."""
    before = (
        'Group {\n  children [\n    Robot {\n      name "robotino"\n      controller "ros"\n    }\n  ]\n}'
    )
    added = '      controllerArgs [\n        "--name=NAME"\n        "--synchronize"\n      ]\n'

    assert generated(before) == before.replace('"ros"\n', '"ros"\n' + added)


def test_a_clock_goes_with_the_gap_before_it(generated: Callable[..., str]) -> None:
    """A gap with a comment stays, because the comment is the author's."""
    arguments = 'controllerArgs ["--clock"\n"--name=a" "--synchronize"{}"--clock" ]'
    kept = 'controllerArgs [\n"--name=NAME" "--synchronize"{} ]'

    assert generated(robot(arguments.format(" ")), clock=False) == robot(kept.format(""))
    assert generated(robot(arguments.format(" #c\n")), clock=False) == robot(kept.format(" #c\n"))


def test_one_clock_of_a_world_may_stay_and_it_is_the_first(
    generated: Callable[..., str],
) -> None:
    """Two robots with one ROS master would publish two different times on `/clock`."""
    first = robot('controllerArgs ["--synchronize" "--clock" "--clock"]')
    second = robot('controllerArgs ["--clock"]', name="b")

    with_clock = generated(first + second, clock=True)

    assert with_clock.count("--clock") == 1
    assert with_clock.index("--clock") < with_clock.index('name "b"')
    assert generated(first + second, clock=False).count("--clock") == 0


def test_a_clock_is_never_added(generated: Callable[..., str]) -> None:
    """The world decides whether a robot publishes a clock; the option `clock` only allows it."""
    assert "--clock" not in generated(robot('controllerArgs ["--name=a"]'), clock=True)


@pytest.mark.parametrize(
    "around",
    [
        "Group {{ children [ {} ] }}",
        "Pose {{ children {} }}",
        "Solid {{ children [ HingeJoint {{ endPoint {} }} ] }}",
        "ConveyorBelt {{ slot [ Lamp {{ }} {} ] }}",
    ],
)
def test_a_robot_is_found_wherever_it_is_nested(generated: Callable[..., str], around: str) -> None:
    """Webots allows a robot at every place where it allows a node."""
    assert generated(around.format(robot(""))).count("NAME") == 1


def test_a_robot_within_a_robot_gets_its_own_name(world: Make, identity: RunIdentity) -> None:
    """The outer robot's arguments may come before or after the inner robot."""
    inner = robot('controllerArgs ["--name=a"]', name="arm")
    made = generate(world(robot(f'children [ {inner} ] controllerArgs "--name=b"')), identity, clock=False)

    assert [found.ros_name for found in robots(made)] == [
        ros_name(identity, "robotino"),
        ros_name(identity, "arm"),
    ]


def test_a_proto_whose_controller_is_ros_is_a_robot(world: Make, identity: RunIdentity) -> None:
    """The robot's default name is in the PROTO's file, but the generator does not read this file.

    So it uses the type as the name.
    """
    made = generate(world('Robotino3 { controller "ros" }'), identity, clock=False)

    assert [found.robot for found in robots(made)] == ["Robotino3"]
    assert robots(made)[0].ros_name == ros_name(identity, "Robotino3")


def test_a_robot_without_a_name_is_called_robot(world: Make, identity: RunIdentity) -> None:
    """Webots gives such a robot the name `robot`, so the generated name must contain it too."""
    made = generate(world('Robot { controller "ros" }'), identity, clock=False)

    assert robots(made)[0].ros_name == ros_name(identity, "robot")


@pytest.mark.parametrize(
    "text",
    [
        "",
        'Robot { name "robotino" controller "braitenberg" controllerArgs ["--name=a"] }',
        'Robot { name "robotino" controllerArgs ["--name=a" "--clock"] }',
        'Robot { controller "<extern>" customData "controller \\"ros\\"" }',
        'Solid { } # Robot { controller "ros" }',
    ],
)
def test_other_controllers_are_left_alone(generated: Callable[..., str], text: str) -> None:
    """A robot with another controller does not use ROS, and its arguments belong to its own program."""
    assert generated(text + COMPLETE, clock=False) == text + COMPLETE


def test_a_byte_order_mark_is_accepted_and_kept(identity: RunIdentity) -> None:
    """Some editors write a byte order mark before the header."""
    source = b"\xef\xbb\xbf#VRML_SIM R2023b utf8\n" + COMPLETE.encode()

    made = generate(source, identity, clock=False)

    assert made == source.replace(b"NAME", ros_name(identity, "robotino").encode())


def test_robots_are_described_as_the_world_has_them(world: Make) -> None:
    """`robots` also reads worlds that were not generated, so it returns whatever names the file has.

    The last `--name=` counts, as in the controller.
    """
    text = (
        'Robot { controller "ros" supervisor TRUE controllerArgs ["--name=a" "--name=b"] }'
        'DEF ARM Robot { controller "ros" name "arm" controllerArgs "--synchronize" }'
    )

    assert robots(world(text)) == (
        WorldRobot(robot="robot", ros_name="b", supervisor=True, synchronize=False),
        WorldRobot(robot="arm", ros_name=None, supervisor=False, synchronize=True, definition="ARM"),
    )


def test_using_what_holds_no_robot_is_fine(generated: Callable[..., str]) -> None:
    """Many worlds use the same Shape twice."""
    text = "Solid { children DEF BODY Shape { } boundingObject USE BODY }" + COMPLETE

    assert generated(text) == text


@pytest.mark.parametrize(
    "text",
    [
        'EXTERNPROTO "webots://projects/Lamp.proto"',
        'EXTERNPROTO "HTTPS://example.org/Lamp.proto"',
        'Mesh { url "/opt/meshes/a.obj" }',
        'Motor { sound "" }',
        'TexturedBackground { texture "mountains" }',
        'Robot { controller "../my" window "a.b" }',
    ],
)
def test_addresses_that_lead_somewhere_from_everywhere_are_fine(
    generated: Callable[..., str], text: str
) -> None:
    """An absolute address, or a text that only looks like an address, is valid in every folder."""
    assert generated(text + COMPLETE) == text + COMPLETE


def test_a_world_beside_its_files_may_name_them_by_relative_addresses(
    world: Make, identity: RunIdentity, refusal: Callable[..., str]
) -> None:
    """The addresses lead to files next to the world. All other rules still apply to such a world."""
    text = 'EXTERNPROTO "../Lamp.proto" Mesh { url "a.obj" }' + COMPLETE

    made = generate(world(text), identity, clock=False, relative_addresses=True)

    assert made == world(text.replace("NAME", ros_name(identity, "robotino")))
    assert "a second robot" in refusal(text + robot("") * 2, relative_addresses=True)


def test_a_world_beside_another_has_a_suffix_behind_its_names_and_no_clock(world: Make) -> None:
    """Both simulators use one ROS master, so only the first may publish the time."""
    source = world(robot('controllerArgs ["--name=arm" "--clock" "--synchronize"]'))

    made = rename(source, "_2")

    assert made == source.replace(b"arm", b"arm_2").replace(b' "--clock"', b"")


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            "",
            'my.wbt:2:1: the robot "robotino" has no ROS name; add "--name=..." to its controllerArgs',
        ),
        (
            f'controllerArgs "--name={"a" * 62}"',
            (
                f"my.wbt:2:1: the ROS name {'a' * 62}_2 has more than 63 bytes;"
                " shorten the name in controllerArgs"
            ),
        ),
    ],
    ids=["none", "too long"],
)
def test_a_name_that_cannot_have_a_suffix_is_refused(world: Make, arguments: str, message: str) -> None:
    """The controller would truncate the longer name."""
    with pytest.raises(WorldError) as caught:
        rename(world(robot(arguments)), "_2", name="my.wbt")

    assert str(caught.value) == message
