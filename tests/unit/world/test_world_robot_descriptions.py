"""The descriptions of Webots' robots have the fields, devices and wheels of Webots' documentation.

The numbers here come from Webots' user guide and PROTO files, not from the descriptions.
"""

import math
from typing import NamedTuple

import pytest

from palaestra_sim.world import Node, World, builtin, parse, parse_proto
from palaestra_sim.world.tree import walk
from tests.unit.world.robot_descriptions import (
    ARMS,
    CARS,
    GEOMETRIES,
    PARTS,
    PROTOS,
    ROBOTS,
    ROVERS,
    described,
    numbers,
    of_type,
)

COMMON = "translation rotation name controller controllerArgs customData supervisor synchronization"
FIELDS = {
    "E-puck": "window battery version camera_fieldOfView camera_width camera_height camera_antiAliasing "
    "camera_rotation camera_noise camera_motionBlur distance_sensor_numberOfRays emitter_channel "
    "receiver_channel turretSlot groundSensorsSlot kinematic",
    "Pioneer3at": "window extensionSlot",
    "Pioneer3dx": "window extensionSlot",
    "Robotino3": "model window selfCollision topSlot bodySlot cameraSlot middleSlot bottomSlot "
    "infraredSensorModel",
    "TurtleBot3Burger": "extensionSlot",
    "Moose": "window color bodySlot",
    "Rosbot": "selfCollision cameraSlot lidarSlot",
    "RosbotXl": "selfCollision lidarSlot",
    "BmwX5": "color engineSound windshieldWipers frontSpotLights rearMirror leftWingMirror rightWingMirror "
    "mirrorFar sensorsSlotFront sensorsSlotRear sensorsSlotTop sensorsSlotCenter interior "
    "dynamicSpeedDisplay indicatorLevers steeringWheel completeInterior shifter "
    "outerWindowTransparency innerWindowTransparency innerWindowDust window",
    "TeslaModel3": "color plate engineSound sensorsSlotFront sensorsSlotRear sensorsSlotTop "
    "sensorsSlotCenter frontSpotLights window",
    **dict.fromkeys(ARMS, "window selfCollision toolSlot staticBase"),
}
NAMES = {
    "E-puck": "e-puck",
    "Pioneer3at": "Pioneer 3-AT",
    "Pioneer3dx": "Pioneer 3-DX",
    "Robotino3": "Robotino 3",
    "TurtleBot3Burger": "TurtleBot3Burger",
    "Moose": "moose",
    "Rosbot": "Rosbot",
    "RosbotXl": "rosbot_xl",
    "BmwX5": "vehicle",
    "TeslaModel3": "vehicle",
    **{arm: arm for arm in ARMS},
}
# Fields that choose a variant of a robot. The descriptions have only the default variant.
WITHOUT_EFFECT = {
    "E-puck": {"version", "kinematic"},
    "Robotino3": {"infraredSensorModel"},
    "CharacterSkin": {"model"},
    "VelodynePuck": {"version"},
    "Moose": {"color"},
    "BmwX5": set(FIELDS["BmwX5"].split())
    - {"window", "sensorsSlotFront", "sensorsSlotRear", "sensorsSlotTop", "sensorsSlotCenter"},
    "TeslaModel3": {"plate", "engineSound", "frontSpotLights"},
}

TWO = ("left wheel", "right wheel")
IMU = {f"imu {it}" for it in ("accelerometer", "gyro", "compass", "inertial_unit")}
CORNERS = ("front left", "front right", "rear left", "rear right")
FOUR = ("back left wheel", "back right wheel", "front left wheel", "front right wheel")
SONARS = {f"so{i}" for i in range(16)}
OF_CARS = (
    {f"{it}_{part}" for it in ("left", "right") for part in ("steer", "steer_sensor")}
    | {
        f"{it}_{end}_{part}"
        for it in ("left", "right")
        for end in ("front", "rear")
        for part in ("sensor", "brake")
    }
    | {f"{it}_lights" for it in ("front", "antifog", "brake", "rear", "backwards")}
    | {"right_indicators", "left_indicators", "engine_speaker"}
)
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
DEVICES = {
    "E-puck": {f"{it} {part}" for it in TWO for part in ("motor", "sensor")}
    | {f"{it}{i}" for it in ("ps", "ls") for i in range(8)}
    | {f"led{i}" for i in range(10)}
    | {"camera", "accelerometer", "gyro", "emitter", "receiver", "speaker"},
    "Pioneer3at": {f"{it}{part}" for it in FOUR for part in ("", " sensor")} | SONARS,
    "Pioneer3dx": {f"{it}{part}" for it in TWO for part in ("", " sensor")}
    | SONARS
    | {"green led", "lower yellow led", "red led 1", "red led 2", "red led 3", "white led", "yellow led"},
    "Robotino3": {f"wheel{i}_joint{part}" for i in range(3) for part in ("", "_sensor")}
    | {f"ir{i}" for i in range(1, 10)}
    | {"accelerometer", "compass", "gyro", "inertial unit", "touch sensor"},
    "TurtleBot3Burger": {f"{it} {part}" for it in TWO for part in ("motor", "sensor")}
    | {"accelerometer", "gyro", "compass"},
    "Moose": {f"{it} motor {i}" for it in ("left", "right") for i in range(1, 5)},
    "Rosbot": {f"{it} wheel motor{part}" for it in CORNERS for part in ("", " sensor")}
    | {f"{it} distance sensor" for it in CORNERS}
    | IMU,
    "RosbotXl": {f"{it}_wheel_joint" for it in ("fl", "fr", "rl", "rr")}
    | {f"{it} wheel motor sensor" for it in CORNERS}
    | IMU,
    "BmwX5": OF_CARS
    | {"left_front_wheel", "right_front_wheel", "wiper_sensor"}
    | {"left_wiper_motor", "right_wiper_motor"},
    "TeslaModel3": OF_CARS | {"left_rear_wheel", "right_rear_wheel"},
    **{arm: {f"{it}_joint{part}" for it in JOINTS for part in ("", "_sensor")} for arm in ARMS},
}
TYPES_OF_DEVICES = {
    "Accelerometer", "Brake", "Camera", "Compass", "DistanceSensor", "Emitter", "Gyro", "InertialUnit", "LED",
    "Lidar", "LightSensor", "PositionSensor", "RangeFinder", "Receiver", "RotationalMotor", "Skin", "Speaker",
    "TouchSensor",
}  # fmt: skip
# Node types that need no PROTO and no file of a Webots installation.
PLAIN = TYPES_OF_DEVICES | {
    "Box", "Capsule", "Cylinder", "Group", "HingeJoint", "HingeJointParameters", "Physics", "Pose", "Robot",
    "Solid", "Sphere", "Zoom",
}  # fmt: skip

# The default sensors in the slots of robots.
OF_SLOTS = {"TurtleBot3Burger": {"RobotisLds01"}, "Rosbot": {"Astra", "RpLidarA2"}, "RosbotXl": {"RpLidarA2"}}


class Drive(NamedTuple):
    """The documented values of a drive, in m, rad/s and kg."""

    radius: float
    wheels: set[tuple[float, float]]
    max_velocity: float
    mass: float


DRIVES = {
    "E-puck": Drive(0.02, {(0, 0.026), (0, -0.026)}, 6.28, 0.15),
    "Pioneer3at": Drive(
        0.11, {(x, y) for x in (0.1331, -0.1331) for y in (0.197, -0.197)}, max_velocity=6.4, mass=8.8
    ),
    "Pioneer3dx": Drive(0.0975, {(0, 0.165), (0, -0.165)}, 12.3, 6.73),
    "Robotino3": Drive(0.063, {(-0.1826, 0), (0.0913, -0.158136), (0.0913, 0.158136)}, 137.46, 20),
    "TurtleBot3Burger": Drive(0.033, {(0, 0.08), (0, -0.08)}, 6.67, 0.825735),
}


def within(node: Node, world: World) -> list[Node]:
    """Return a node and its descendants."""
    start, end = node.span
    return [inner for inner in world.walk() if start <= inner.span[0] and inner.span[1] <= end]


def driven(name: str) -> list[tuple[Node, Node]]:
    """Return the motor and the wheel of each joint with a motor."""
    return [
        (of_type(joint.nodes("device"), "RotationalMotor")[0], joint.nodes("endPoint")[0])
        for joint in of_type(described(name).body.walk(), "HingeJoint")
        if joint.nodes("device")
    ]


def test_each_description_is_of_the_proto_that_its_file_is_named_after() -> None:
    """The reader looks for a PROTO in the file of the same name."""
    files = sorted(path.stem for path in PROTOS.glob("*.proto"))

    assert files == sorted(ROBOTS + ROVERS + CARS + ARMS + PARTS + GEOMETRIES)
    assert [described(name).name for name in files] == files


@pytest.mark.parametrize("name", ROBOTS + ROVERS + CARS + ARMS)
def test_a_world_can_set_every_documented_field(name: str) -> None:
    """Any other field is an error, because Webots would also reject a misspelled field."""
    without = {"customData"} if name in (*CARS, *ARMS, "Moose") else set()
    common = set(COMMON.split()) - without - ({"supervisor"} if name == "Moose" else set())
    assert set(described(name).defaults) == common | set(FIELDS[name].split())


@pytest.mark.parametrize("name", ROBOTS + ROVERS + CARS + ARMS + PARTS)
def test_a_field_without_effect_is_one_that_chooses_a_variant(name: str) -> None:
    """All other fields are used in the body, so they have the same effect as in Webots."""
    description = described(name)
    is_light = name in {"RobotisLds01", "SickS300"} or name.startswith(("Hokuyo", "Velodyne"))
    without = ({"enablePhysics"} if is_light else set()) | WITHOUT_EFFECT.get(name, set())

    assert set(description.defaults) - description.used == without


@pytest.mark.parametrize("name", ROBOTS + ROVERS + CARS + ARMS)
def test_a_robot_has_its_documented_name(name: str) -> None:
    """The ROS name of a robot contains this name."""
    (robot,) = described(name).body.nodes

    assert robot.type_name == "Robot"
    assert robot.text("name") == NAMES[name]


@pytest.mark.parametrize("name", ROBOTS + ROVERS + CARS + ARMS + PARTS)
def test_descriptions_need_no_other_file_and_draw_nothing(name: str) -> None:
    """A simulator without an installation of Webots uses the descriptions.

    They refer to no other file, except to the descriptions of their sensors.
    """
    description = described(name)
    types = {node.type_name for node in description.body.walk()}

    assert types <= PLAIN | OF_SLOTS.get(name, set())


@pytest.mark.parametrize("name", ROBOTS + ROVERS + CARS + ARMS)
def test_a_robot_has_the_documented_devices(name: str) -> None:
    """A program finds devices by name, so each name occurs once."""
    devices = of_type(described(name).body.walk(), *TYPES_OF_DEVICES)
    names = [device.text("name") for device in devices]

    assert set(names) == DEVICES[name]
    assert len(names) == len(DEVICES[name])


@pytest.mark.parametrize("name", ROBOTS)
def test_wheels_are_where_webots_has_them_and_as_large(name: str) -> None:
    """A program's odometry uses the wheel radius and the track."""
    body = described(name).body
    centers = {numbers(wheel, "translation")[:2] for _, wheel in driven(name)}
    radii = [
        max(numbers(it, "radius")[0] for it in of_type(within(wheel, body), "Cylinder"))
        for _, wheel in driven(name)
    ]

    assert centers == DRIVES[name].wheels
    assert radii == [DRIVES[name].radius] * len(DRIVES[name].wheels)


@pytest.mark.parametrize("name", ROBOTS)
def test_wheels_stand_on_the_floor(name: str) -> None:
    """The height is that of the default translation.

    As in Webots, the wheels of the Robotino 3 are 4 mm below the floor.
    """
    height = float(described(name).defaults["translation"].split()[2])

    lowest = [height + numbers(wheel, "translation")[2] - DRIVES[name].radius for _, wheel in driven(name)]

    assert lowest == pytest.approx([-0.00385 if name == "Robotino3" else 0.0] * len(lowest))


@pytest.mark.parametrize("name", ROBOTS + ROVERS)
def test_a_wheel_turns_about_its_axle(name: str) -> None:
    """The anchor of a joint may be any point on the axle; the e-puck's anchor is between its wheels."""
    for joint in of_type(described(name).body.walk(), "HingeJoint"):
        if joint.nodes("device"):
            (parameters,), (wheel,) = joint.nodes("jointParameters"), joint.nodes("endPoint")
            axis, anchor = numbers(parameters, "axis"), numbers(parameters, "anchor")
            arm = [a - b for a, b in zip(numbers(wheel, "translation"), anchor, strict=True)]
            along = sum(a * b for a, b in zip(arm, axis, strict=True))

            assert math.hypot(*axis) == pytest.approx(1, abs=1e-5)
            assert arm == pytest.approx([along * it for it in axis], abs=1e-6)


@pytest.mark.parametrize("name", ROBOTS)
def test_motors_and_bodies_have_the_documented_limits_and_masses(name: str) -> None:
    """A program scales its commands by the `maxVelocity` of the motors."""
    (robot,) = described(name).body.nodes
    (physics,) = robot.nodes("physics")

    assert {numbers(motor, "maxVelocity") for motor, _ in driven(name)} == {(DRIVES[name].max_velocity,)}
    assert numbers(physics, "mass") == (DRIVES[name].mass,)
    assert robot.nodes("boundingObject")


@pytest.mark.parametrize(("height", "mass"), [(0.530447, 2.434), (1.0, 2.852)])
def test_the_platform_of_the_robotino_has_the_mass_of_its_height(height: float, mass: float) -> None:
    """A robot with a high platform tips over sooner.

    The table weighs 1.961 kg, and the tube 0.891 kg for each meter; the center of mass is that of both parts.
    """
    path = PROTOS / "Robotino3Platform.proto"
    written = path.read_text().replace("SFFloat    height      0.530447", f"SFFloat height {height}")
    body = parse_proto(written.encode(), path.name).body
    (physics,) = body.nodes("physics")
    table, tube = (numbers(it, "translation")[2] for it in of_type(walk([body]), "Pose")[1:])

    assert numbers(physics, "mass") == pytest.approx((mass,), abs=1e-3)
    assert (table, tube) == pytest.approx((height + 0.006553, height / 2))
    assert numbers(physics, "centerOfMass") == pytest.approx(
        (0, 0, (1.9611 * table + (mass - 1.9611) * tube) / mass), abs=1e-3
    )


def test_the_robotino_is_the_one_of_the_arena() -> None:
    """Wheels, rollers and infrared sensors are the same as in the arena, so a policy fits both robots."""
    arena, robotino = parse(builtin("arena")), described("Robotino3").body
    ours = {it.text("name"): it for it in of_type(arena.walk(), "DistanceSensor")}
    theirs = {it.text("name"): it for it in of_type(robotino.walk(), "DistanceSensor")}
    axes = [
        [numbers(it, "axis") + numbers(it, "anchor") for it in of_type(world.walk(), "HingeJointParameters")]
        for world in (arena, robotino)
    ]

    assert {wheel.text("contactMaterial") for _, wheel in driven("Robotino3")} == {"WheelMat"}
    assert axes[0] == [pytest.approx(it, abs=1e-3) for it in axes[1]]
    for name, sensor in theirs.items():
        assert numbers(sensor, "lookupTable") == numbers(ours[name], "lookupTable")
        assert numbers(sensor, "translation") == pytest.approx(numbers(ours[name], "translation"), abs=1e-3)


def test_the_wheels_of_the_moose_are_where_its_manufacturer_puts_them() -> None:
    """A client's odometry uses the distances, which are those of Clearpath's `moose_description`.

    The heights are relative to the axles of the wheels in the middle, which touch the floor first.
    """
    body = described("Moose").body
    axles = [(1.0036, 0.02223), (0.33639, 0), (-0.33638, 0), (-1.01123, 0.02223)]
    wheels = {motor.text("name"): numbers(wheel, "translation") for motor, wheel in driven("Moose")}

    for side, y in (("left", 0.6249), ("right", -0.6249)):
        for number, (x, z) in enumerate(axles, 1):
            assert wheels[f"{side} motor {number}"] == pytest.approx((x, y, z - 0.06))
    for _, wheel in driven("Moose"):
        (tire,), (physics,) = of_type(within(wheel, body), "Cylinder"), wheel.nodes("physics")
        assert numbers(tire, "radius") + numbers(tire, "height") == (0.3175, 0.303)
        assert numbers(physics, "mass") == (16.8,)
    (robot,) = body.nodes
    assert numbers(robot.nodes("physics")[0], "mass") == (1590,)
    assert {numbers(motor, "maxVelocity") for motor, _ in driven("Moose")} == {(26,)}


def test_the_rosbot_is_the_one_of_its_manufacturer() -> None:
    """The distances are those of Husarion's `rosbot_description`, for wheels and infrared sensors."""
    body = described("Rosbot").body
    wheels = {motor.text("name"): wheel for motor, wheel in driven("Rosbot")}
    eyes = {it.text("name"): it for it in of_type(body.walk(), "DistanceSensor")}
    yaws = dict(zip(CORNERS, (0.13, -0.13, 3.01, 3.27), strict=True))

    for name in CORNERS:
        x, y = (1 if "front" in name else -1), (1 if "left" in name else -1)
        wheel, eye = wheels[f"{name} wheel motor"], eyes[f"{name} distance sensor"]
        (tire,), (physics,) = of_type(within(wheel, body), "Cylinder"), wheel.nodes("physics")
        assert numbers(wheel, "translation") == (0.053 * x, 0.096 * y, 0.0425)
        assert numbers(tire, "radius") + numbers(tire, "height") == (0.0425, 0.036)
        assert numbers(physics, "mass") == (0.1,)
        assert numbers(eye, "translation") == (0.1 * x, 0.05 * y, 0.0525)
        assert numbers(eye, "rotation") == (0, 0, 1, yaws[name])
        assert numbers(eye, "lookupTable") == (0, 0, 0, 2, 2, 0)
    (robot,) = body.nodes
    assert numbers(robot.nodes("physics")[0], "mass") == (2,)


def test_the_rosbot_xl_is_the_one_of_its_manufacturer() -> None:
    """The distances and masses are those of Husarion's `rosbot_description` with Mecanum wheels."""
    wheels = {numbers(wheel, "translation"): wheel for _, wheel in driven("RosbotXl")}
    (robot,) = described("RosbotXl").body.nodes

    assert set(wheels) == {(x, y, 0.048) for x in (0.085, -0.085) for y in (0.135, -0.135)}
    assert [numbers(it.nodes("physics")[0], "mass") for it in (robot, *wheels.values())] == [
        (3.5,),
        *[(0.4,)] * 4,
    ]


def test_the_astra_sees_as_its_data_sheet_says() -> None:
    """Both devices have 640 by 480 pixels and see 60 degrees; the depth ends at 8 m."""
    body = described("Astra").body
    (camera,), (depth,) = of_type(body.walk(), "Camera"), of_type(body.walk(), "RangeFinder")

    assert (camera.text("name"), depth.text("name")) == ("Astra rgb", "Astra depth")
    for device in (camera, depth):
        assert numbers(device, "width") + numbers(device, "height") == (640, 480)
        assert numbers(device, "fieldOfView") == pytest.approx((math.radians(60),), abs=0.01)
    assert numbers(depth, "minRange") + numbers(depth, "maxRange") == (0.6, 8)


@pytest.mark.parametrize(
    ("name", "wheelbase", "half_track", "radius"),
    [("BmwX5", 2.995, 0.814, 0.374), ("TeslaModel3", 2.94, 0.86, 0.36)],
)
def test_a_car_has_the_wheels_that_its_documentation_names(
    name: str, wheelbase: float, half_track: float, radius: float
) -> None:
    """A client computes the steering angles from wheelbase and track."""
    body = described(name).body
    wheels = {
        wheel.text("name"): wheel
        for wheel in of_type(body.walk(), "Solid")
        if (wheel.text("name") or "").endswith("wheel")
    }
    hubs = [it for it in of_type(body.walk(), "Solid") if (it.text("name") or "").endswith("hub")]
    rear = {numbers(wheels[f"rear {it} wheel"], "translation")[1] for it in ("left", "right")}

    assert {numbers(it, "translation") for it in hubs} == {
        (wheelbase, half_track, 0),
        (wheelbase, -half_track, 0),
    }
    assert rear == {half_track, -half_track}
    assert {
        numbers(it, "radius") for wheel in wheels.values() for it in of_type(within(wheel, body), "Cylinder")
    } == {(radius,)}
