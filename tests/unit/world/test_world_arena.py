"""The built-in worlds: their content, and the worlds that are generated from them."""

import math
from itertools import pairwise

import pytest

from palaestra_sim.world import (
    Node,
    RunIdentity,
    UnknownWorldError,
    World,
    WorldRobot,
    builtin,
    generate,
    parse,
    robots,
)

# All node types in the built-in worlds. They belong to Webots itself, so no file is downloaded.
PLAIN = {
    "Background", "Box", "Camera", "ContactProperties", "Cylinder", "DirectionalLight", "DistanceSensor",
    "HingeJoint", "HingeJointParameters", "PBRAppearance", "Physics", "Pose", "PositionSensor",
    "RangeFinder", "Robot", "RotationalMotor", "Shape", "Solid", "TouchSensor", "Viewpoint", "WorldInfo",
}  # fmt: skip


@pytest.fixture(params=["arena", "seeing", "two_robots"])
def shipped(request: pytest.FixtureRequest) -> bytes:
    """Return each built-in world in turn."""
    return builtin(request.param)


@pytest.fixture
def scene(shipped: bytes) -> World:
    """Return the parsed world."""
    return parse(shipped)


def of_type(world: World, type_name: str) -> list[Node]:
    """Return the nodes of a type, in source order."""
    return [node for node in world.walk() if node.type_name == type_name]


def defined(world: World, name: str) -> Node:
    """Return the node with a DEF name."""
    (node,) = [node for node in world.walk() if node.def_name == name]
    return node


def sees(world: World) -> bool:
    """Return whether a world has cameras."""
    return bool(of_type(world, "Camera"))


def test_an_unknown_world_names_those_that_ship() -> None:
    """The argument is the name of a built-in world, not a path."""
    message = 'no built-in world is called "../secret"; choose one of arena, court, pen, seeing, two_robots'

    with pytest.raises(UnknownWorldError, match=message):
        builtin("../secret")


def test_the_arena_has_one_robot_that_is_its_own_supervisor() -> None:
    """Through a single ROS node, a trainer then steps the simulation, reads sensors and moves objects."""
    assert robots(builtin("arena")) == (
        WorldRobot(
            robot="robotino", ros_name="robotino", supervisor=True, synchronize=True, definition="ROBOTINO"
        ),
    )


def test_worlds_with_a_separate_supervisor_work_too() -> None:
    """Of the two robots, only the supervisor has the option `--clock`."""
    supervisor, robotino = robots(builtin("two_robots"))

    assert (supervisor.robot, supervisor.supervisor) == ("supervisor", True)
    assert (robotino.robot, robotino.supervisor) == ("robotino", False)
    assert builtin("two_robots").count(b'"--clock"') == 1


def test_simulators_can_be_made_of_it(shipped: bytes, identity: RunIdentity) -> None:
    """Generation reads no other file, and a second generation changes nothing."""
    made = generate(shipped, identity, clock=True)

    assert generate(made, identity, clock=True) == made
    assert all(robot.ros_name and robot.synchronize for robot in robots(made))


def test_it_needs_nothing_from_elsewhere(scene: World) -> None:
    """A simulator's pod has no network and no folder of PROTOs."""
    assert scene.externs == ()
    assert {node.type_name for node in scene.walk() if not node.uses} <= PLAIN


def test_every_use_has_its_def_before_it(scene: World) -> None:
    """Webots ignores a USE whose DEF comes later in the file."""
    seen = set()
    for node in scene.walk():
        seen.add(node.def_name)
        assert node.uses is None or node.uses in seen


def test_time_goes_in_steps_of_32_ms_and_wheels_slide_sideways(scene: World) -> None:
    """The wheels' rollers are modeled by zero friction across the wheel."""
    (info,) = of_type(scene, "WorldInfo")
    (contact,) = info.nodes("contactProperties")

    assert info.numbers("basicTimeStep") == (32,)
    assert contact.text("material1") == "WheelMat"
    assert contact.numbers("coulombFriction") == (0, 2, 0)
    assert contact.numbers("bounce") == (0,)


def test_the_floor_is_4_by_4_m_with_its_top_at_zero(scene: World) -> None:
    """Start and target are drawn on this floor, which is centered on the origin."""
    floor = defined(scene, "FLOOR")
    size = defined(scene, "FLOOR_BOX").numbers("size") or ()

    assert size[:2] == (4, 4)
    assert floor.numbers("translation") == (0, 0, -size[2] / 2)


@pytest.mark.parametrize(("wall", "axis", "side"), [(0, 0, 1), (1, 1, 1), (2, 0, -1), (3, 1, -1)])
def test_walls_stand_with_their_inner_faces_2_m_from_the_origin(
    scene: World, wall: int, axis: int, side: int
) -> None:
    """The walls are 0.1 m thick and 0.3 m high; their collision shape equals the visible shape."""
    center = defined(scene, f"WALL_{wall}").numbers("translation") or ()
    size = defined(scene, f"WALL_{wall}_BOX").numbers("size") or ()

    assert abs(center[axis]) - size[axis] / 2 == pytest.approx(2)
    assert math.copysign(1, center[axis]) == side
    assert (size[axis], size[2], center[2]) == (0.1, 0.3, 0.15)
    assert size[1 - axis] >= 4
    assert defined(scene, f"WALL_{wall}").nodes("boundingObject")[0].uses == f"WALL_{wall}_BOX"


def test_four_cylinders_stand_in_the_corners_of_a_square(scene: World) -> None:
    """In some episodes, a robot must drive around the cylinders."""
    cylinders = [defined(scene, f"CYLINDER_{number}") for number in range(4)]
    shapes = [defined(scene, f"CYLINDER_{number}_SHAPE") for number in range(4)]

    z = -0.7 if sees(scene) else 0.2  # in the world with cameras they are below the floor
    assert [cylinder.numbers("translation") for cylinder in cylinders] == [
        (0.8, 0.8, z),
        (-0.8, 0.8, z),
        (-0.8, -0.8, z),
        (0.8, -0.8, z),
    ]
    assert {(s.numbers("radius"), s.numbers("height")) for s in shapes} == {((0.25,), (0.4,))}
    assert all(cylinder.nodes("boundingObject")[0].uses for cylinder in cylinders)


def test_the_target_is_seen_and_never_felt(scene: World) -> None:
    """The target is a disk with the radius within which it counts as reached.

    For cameras it is a pole of 0.5 m.
    """
    target = defined(scene, "TARGET")
    (shape,) = target.nodes("children")[0].nodes("geometry")
    form = tuple(shape.numbers(name) for name in ("radius", "height"))

    assert form == (((0.05,), (0.5,)) if sees(scene) else ((0.2,), (0.002,)))
    assert (target.numbers("translation") or ())[2] == (0.25 if sees(scene) else 0.001)
    assert target.numbers("translation") is not None
    assert "boundingObject" not in target.fields


@pytest.mark.parametrize("wheel", [0, 1, 2])
def test_wheels_turn_about_the_line_from_the_middle_of_the_robot(scene: World, wheel: int) -> None:
    """As in the Robotino 3 of Webots, a positive wheel speed turns the robot clockwise."""
    joint = of_type(scene, "HingeJoint")[wheel]
    motor, sensor = joint.nodes("device")
    (parameters,) = joint.nodes("jointParameters")
    (rim,) = joint.nodes("endPoint")
    x, y, height = parameters.numbers("anchor") or ()
    axis_x, axis_y, _ = parameters.numbers("axis") or ()

    assert motor.text("name") == f"wheel{wheel}_joint"
    assert motor.numbers("maxVelocity") == (137.46,)
    assert sensor.text("name") == f"wheel{wheel}_joint_sensor"
    assert (x, y) == [(-0.1826, 0), (0.0913, -0.158), (0.0913, 0.158)][wheel]
    assert (axis_x, axis_y) == pytest.approx((x / 0.1826, y / 0.1826), abs=1e-3)
    assert height == 0.05915
    assert rim.numbers("translation") == (x, y, height)
    assert rim.text("contactMaterial") == "WheelMat"
    assert rim.numbers("rotation") == pytest.approx((0, 0, 1, math.atan2(y, x)), abs=1e-3)


def test_nine_infrared_rays_leave_the_rim_every_40_degrees(scene: World) -> None:
    """The rays go counterclockwise from the front; each looks along the x axis of its sensor."""
    sensors = of_type(scene, "DistanceSensor")

    assert [sensor.text("name") for sensor in sensors] == [f"ir{n}" for n in range(1, 10)]
    for number, sensor in enumerate(sensors):
        azimuth = math.remainder(math.radians(40 * number), 2 * math.pi)
        x, y, z = sensor.numbers("translation") or ()
        assert (math.hypot(x, y), z) == (pytest.approx(0.2264, abs=1e-4), 0.0566)
        assert math.atan2(y, x) == pytest.approx(azimuth, abs=1e-3)
        assert sensor.numbers("rotation") == pytest.approx((0, 0, 1, azimuth), abs=1e-3)


def test_infrared_sensors_answer_in_volts_with_noise(scene: World) -> None:
    """The table is that of the sensor Sharp GP2Y0A41SK0F, whose voltage falls with the distance."""
    for sensor in of_type(scene, "DistanceSensor"):
        table = sensor.numbers("lookupTable") or ()
        meters, volts, noise = table[0::3], table[1::3], table[2::3]
        assert (meters[0], volts[0]) == (0.03, 3.03)
        assert (meters[-1], volts[-1]) == (0.4, 0.31)
        assert len(meters) == 18
        assert all(near < far for near, far in pairwise(meters))
        assert all(more > less for more, less in pairwise(volts))
        assert set(noise) == {0.005}


def test_the_bumper_is_wider_than_the_body_and_clear_of_the_floor(scene: World) -> None:
    """The bumper in the PROTO of Webots has no boundingObject, so it never reports a contact."""
    (bumper,) = of_type(scene, "TouchSensor")
    (rim,) = bumper.nodes("boundingObject")
    (height,) = rim.numbers("height") or ()
    _, _, middle = bumper.numbers("translation") or ()

    assert (bumper.text("name"), bumper.text("type")) == ("touch sensor", "bumper")
    assert defined(scene, "BODY").numbers("radius") == (0.2266,)
    assert (rim.numbers("radius") or (0,))[0] > 0.2266
    assert middle - height / 2 > 0.01


def test_the_body_weighs_20_kg(scene: World) -> None:
    """Webots computes the acceleration of the robot from this mass.

    The collision shape of the body equals its visible shape.
    """
    robot = defined(scene, "ROBOTINO")
    (physics,) = robot.nodes("physics")
    (bounds,) = robot.nodes("boundingObject")

    assert physics.numbers("mass") == (20,)
    assert bounds.nodes("children")[0].uses == "BODY"


def test_both_cameras_look_forward_from_one_place() -> None:
    """A pixel of the depth image and the same pixel of the color image then show the same point."""
    scene = parse(builtin("seeing"))
    (camera,), (depth_camera,) = of_type(scene, "Camera"), of_type(scene, "RangeFinder")

    assert (camera.text("name"), depth_camera.text("name")) == ("camera", "depth camera")
    assert (camera.numbers("width"), camera.numbers("height")) == ((64,), (48,))
    for name in ("translation", "fieldOfView", "width", "height"):
        assert camera.numbers(name) == depth_camera.numbers(name)
    assert "rotation" not in camera.fields
