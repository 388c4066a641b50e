"""The descriptions of Webots' robots have the fields, devices and wheels of Webots' documentation.

The numbers here come from Webots' user guide and PROTO files, not from the descriptions.
"""

import math
import re
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple

import pytest

import palaestra_sim.world
from palaestra_sim.world import Node, World, builtin, parse

PROTOS = Path(palaestra_sim.world.__file__).parent / "protos"
ROBOTS = ("E-puck", "Pioneer3at", "Pioneer3dx", "Robotino3", "TurtleBot3Burger")
CARS = ("BmwX5",)
LIDARS = {
    "HokuyoUrg04lx": (240, 667, 0.06, 4.095),
    "HokuyoUrg04lxug01": (240, 667, 0.2, 5.6),
    "HokuyoUtm30lx": (270, 1080, 0.1, 30),
    "RpLidarA2": (89.954, 800, 0.2, 12),
    "SickLms291": (180, 180, None, 80),
    "SickS300": (270, 540, None, 30),
    "VelodynePuck": (360, 3600, 1, 100),
    "VelodyneVLP-16": (360, 3600, 1, 100),
    "VelodyneHDL-32E": (90, 4500, 1, 70),
    "VelodyneHDL-64E": (90, 4500, 0.8, 120),
}
# The number of layers, the elevations of the highest and the lowest layer in degrees, and the noise in
# meters.
LAYERS = {
    "VelodynePuck": (16, 15, -15, 0.03),
    "VelodyneVLP-16": (16, 15, -15, 0.03),
    "VelodyneHDL-32E": (32, 0.7, -40.7, 0.02),
    "VelodyneHDL-64E": (64, 2, -24.8, 0.02),
}
# The range in meters by the data sheet, and the volts at both ends of the range.
INFRARED = {
    "SharpGP2D120": ((0.04, 2.72), (0.3, 0.42)),
    "SharpGP2Y0A02YK0F": ((0.2, 2.51), (1.5, 0.45)),
    "SharpGP2Y0A41SK0F": ((0.04, 2.72), (0.3, 0.42)),
    "SharpGP2Y0A710K0F": ((1.0, 2.5), (5.5, 1.37)),
}
PARTS = ("CharacterSkin", "E-puckGroundSensors", "Robotino3Webcam", "RobotisLds01", *LIDARS, *INFRARED)

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
    "BmwX5": "color engineSound windshieldWipers frontSpotLights rearMirror leftWingMirror rightWingMirror "
    "mirrorFar sensorsSlotFront sensorsSlotRear sensorsSlotTop sensorsSlotCenter interior "
    "dynamicSpeedDisplay indicatorLevers steeringWheel completeInterior shifter "
    "outerWindowTransparency innerWindowTransparency innerWindowDust window",
}
NAMES = {
    "E-puck": "e-puck",
    "Pioneer3at": "Pioneer 3-AT",
    "Pioneer3dx": "Pioneer 3-DX",
    "Robotino3": "Robotino 3",
    "TurtleBot3Burger": "TurtleBot3Burger",
    "BmwX5": "vehicle",
}
# Fields that choose a variant of a robot. The descriptions have only the default variant.
WITHOUT_EFFECT = {
    "E-puck": {"version", "kinematic"},
    "Robotino3": {"infraredSensorModel"},
    "CharacterSkin": {"model"},
    "VelodynePuck": {"version"},
    "BmwX5": set(FIELDS["BmwX5"].split())
    - {"window", "sensorsSlotFront", "sensorsSlotRear", "sensorsSlotTop", "sensorsSlotCenter"},
}

TWO = ("left wheel", "right wheel")
FOUR = ("back left wheel", "back right wheel", "front left wheel", "front right wheel")
SONARS = {f"so{i}" for i in range(16)}
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
    "BmwX5": {f"{it}_{part}" for it in ("left", "right") for part in ("steer", "steer_sensor", "wiper_motor")}
    | {
        f"{it}_{end}_{part}"
        for it in ("left", "right")
        for end in ("front", "rear")
        for part in ("sensor", "brake")
    }
    | {"left_front_wheel", "right_front_wheel", "wiper_sensor", "engine_speaker"}
    | {f"{it}_lights" for it in ("front", "antifog", "brake", "rear", "backwards")}
    | {"right_indicators", "left_indicators"},
}
TYPES_OF_DEVICES = {
    "Accelerometer", "Brake", "Camera", "Compass", "DistanceSensor", "Emitter", "Gyro", "InertialUnit", "LED",
    "Lidar", "LightSensor", "PositionSensor", "Receiver", "RotationalMotor", "Skin", "Speaker", "TouchSensor",
}  # fmt: skip
# Node types that need no PROTO and no file of a Webots installation.
PLAIN = TYPES_OF_DEVICES | {
    "Box", "Cylinder", "Group", "HingeJoint", "HingeJointParameters", "Physics", "Pose", "Robot", "Solid",
    "Sphere", "Zoom",
}  # fmt: skip

_FILE = re.compile(r"PROTO (?P<name>\S+) \[\n(?P<fields>.*?)\n\]\n\{\n(?P<body>.*)\}\n\Z", re.DOTALL)
_FIELD = re.compile(
    r"field\s+\w+(?:\{[^}]*\})?\s+(?P<name>\w+)\s+(?P<default>[^\n]*?)(?:\s{2}#[^\n]*)?$", re.MULTILINE
)
_IS = re.compile(r"\bIS (\w+)")


class Description(NamedTuple):
    """A PROTO file: its name, its fields with their defaults, and its body with these defaults filled in."""

    name: str
    defaults: dict[str, str]
    used: set[str]
    body: World


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


def described(name: str) -> Description:
    """Return a description, in whose body each `IS` is replaced by the default of the field."""
    text = (PROTOS / f"{name}.proto").read_text()
    header, _, _ = text.partition("\n")
    found = _FILE.search(text)
    assert found, name
    defaults = {it["name"]: it["default"] for it in _FIELD.finditer(found["fields"])}
    body = _IS.sub(lambda match: defaults[match[1]], found["body"])
    return Description(
        name=found["name"],
        defaults=defaults,
        used=set(_IS.findall(found["body"])),
        body=parse(f"{header}\n{body}".encode(), name),
    )


def of_type(nodes: Iterable[Node], *types: str) -> list[Node]:
    """Return the nodes of these types, in source order."""
    return [node for node in nodes if node.type_name in types]


def numbers(node: Node, field: str) -> tuple[float, ...]:
    """Return the numbers of a field, which the node must have."""
    found = node.numbers(field)
    assert found is not None, f"{node.type_name} without {field}"
    return found


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


def headings(name: str, prefix: str) -> list[float]:
    """Return the azimuths in degrees of the distance sensors with a name prefix, ordered by their number."""
    found = {}
    for sensor in of_type(described(name).body.walk(), "DistanceSensor"):
        number = (sensor.text("name") or "").removeprefix(prefix)
        found[int(number)] = math.degrees(heading(numbers(sensor, "rotation")))
    return [found[number] for number in sorted(found)]


def heading(rotation: tuple[float, ...]) -> float:
    """Return the azimuth of the x axis after a rotation, in radians."""
    x, y, z, angle = rotation
    cosine, sine = math.cos(angle), math.sin(angle)
    return math.atan2(x * y * (1 - cosine) + z * sine, x * x * (1 - cosine) + cosine)


def test_each_description_is_of_the_proto_that_its_file_is_named_after() -> None:
    """The reader looks for a PROTO in the file of the same name."""
    files = sorted(path.stem for path in PROTOS.glob("*.proto"))

    assert files == sorted(ROBOTS + CARS + PARTS)
    assert [described(name).name for name in files] == files


@pytest.mark.parametrize("name", ROBOTS + CARS)
def test_a_world_can_set_every_documented_field(name: str) -> None:
    """Any other field is an error, because Webots would also reject a misspelled field."""
    common = set(COMMON.split()) - ({"customData"} if name in CARS else set())
    assert set(described(name).defaults) == common | set(FIELDS[name].split())


@pytest.mark.parametrize("name", ROBOTS + CARS + PARTS)
def test_a_field_without_effect_is_one_that_chooses_a_variant(name: str) -> None:
    """The body uses all other fields, so these have the same effect as in Webots."""
    description = described(name)
    is_light = name in {"RobotisLds01", "SickS300"} or name.startswith(("Hokuyo", "Velodyne"))
    without = ({"enablePhysics"} if is_light else set()) | WITHOUT_EFFECT.get(name, set())

    assert set(description.defaults) - description.used == without


@pytest.mark.parametrize("name", ROBOTS + CARS)
def test_a_robot_has_its_documented_name(name: str) -> None:
    """The ROS name of a robot contains this name."""
    (robot,) = described(name).body.nodes

    assert robot.type_name == "Robot"
    assert robot.text("name") == NAMES[name]


@pytest.mark.parametrize("name", ROBOTS + CARS + PARTS)
def test_descriptions_need_no_other_file_and_draw_nothing(name: str) -> None:
    """A simulator without an installation of Webots uses the descriptions.

    They refer to no other file, except to the lidar's description.
    """
    description = described(name)
    types = {node.type_name for node in description.body.walk()}

    assert types <= PLAIN | ({"RobotisLds01"} if name == "TurtleBot3Burger" else set())
    assert "%<" not in (PROTOS / f"{name}.proto").read_text()


def test_the_lidar_of_the_turtlebot_is_described_beside_it() -> None:
    """The lidar is the default of `extensionSlot`, so a world that does not set the slot has a lidar."""
    text = (PROTOS / "TurtleBot3Burger.proto").read_text()
    (address,) = re.findall(r'^EXTERNPROTO "(.*)"$', text, re.MULTILINE)
    (lidar,) = described("RobotisLds01").body.nodes

    assert (PROTOS / address).is_file()
    assert (lidar.type_name, lidar.text("name")) == ("Lidar", "LDS-01")
    assert numbers(lidar, "horizontalResolution") == (360,)
    assert numbers(lidar, "minRange") + numbers(lidar, "maxRange") == (0.12, 3.5)


@pytest.mark.parametrize("name", LIDARS)
def test_a_lidar_has_the_documented_rays(name: str) -> None:
    """The values are the field of view in degrees, the number of rays, and the range."""
    (lidar,) = described(name).body.nodes
    degrees, rays, nearest, farthest = LIDARS[name]

    assert numbers(lidar, "fieldOfView") == pytest.approx((math.radians(degrees),), abs=1e-4)
    assert numbers(lidar, "horizontalResolution") == (rays,)
    assert lidar.numbers("minRange") == (None if nearest is None else (nearest,))
    assert numbers(lidar, "maxRange") == (farthest,)


@pytest.mark.parametrize("name", LAYERS)
def test_a_lidar_of_many_layers_looks_up_and_down_as_documented(name: str) -> None:
    """The tilt moves all layers, and the noise is a fraction of the range."""
    (lidar,) = described(name).body.nodes
    layers, highest, lowest, noise_m = LAYERS[name]
    (tilt,), (high,) = lidar.numbers("tiltAngle") or (0.0,), numbers(lidar, "verticalFieldOfView")

    assert numbers(lidar, "numberOfLayers") == (layers,)
    assert [math.degrees(tilt + it * high) for it in (0.5, -0.5)] == pytest.approx(
        [highest, lowest], abs=0.05
    )
    assert numbers(lidar, "noise")[0] * LIDARS[name][3] == pytest.approx(noise_m, rel=2e-3)


@pytest.mark.parametrize("name", INFRARED)
def test_an_infra_red_sensor_returns_the_volts_of_its_data_sheet(name: str) -> None:
    """The voltage falls with the distance, also beyond the documented range."""
    (sensor,) = described(name).body.nodes
    table = numbers(sensor, "lookupTable")
    distances, volts = table[::3], table[1::3]

    assert sensor.text("type") is None
    assert set(INFRARED[name]) <= set(zip(distances, volts, strict=True))
    assert sorted(distances) == list(distances)
    assert sorted(volts, reverse=True) == list(volts)


@pytest.mark.parametrize("name", ROBOTS + CARS)
def test_a_robot_has_the_documented_devices(name: str) -> None:
    """A program finds devices by name, so each name occurs once."""
    devices = of_type(described(name).body.walk(), *TYPES_OF_DEVICES)
    names = [device.text("name") for device in devices]

    assert set(names) == DEVICES[name]
    assert len(names) == len(DEVICES[name])


def test_the_ground_sensors_of_the_e_puck_look_down_from_left_to_right() -> None:
    """The ground sensors are part of the robot only if `groundSensorsSlot` contains them."""
    sensors = of_type(described("E-puckGroundSensors").body.walk(), "DistanceSensor")

    assert [it.text("name") for it in sensors] == ["gs0", "gs1", "gs2"]
    assert [numbers(it, "translation")[1] for it in sensors] == [0.01, 0, -0.01]
    assert {numbers(it, "rotation") for it in sensors} == {(0, 1, 0, 1.5708)}


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


@pytest.mark.parametrize("name", ROBOTS)
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


def test_infrared_sensors_of_the_e_puck_look_where_the_user_guide_says() -> None:
    """The user guide counts angles from the negative y axis, in radians."""
    guide = [1.27, 0.77, 0.0, 5.21, 4.21, math.pi, 2.37, 1.87]
    expected = [math.remainder(it - math.pi / 2, math.tau) for it in guide]

    assert headings("E-puck", "ps") == pytest.approx([math.degrees(it) for it in expected], abs=0.5)


@pytest.mark.parametrize("name", ["Pioneer3at", "Pioneer3dx"])
def test_sonars_of_the_pioneers_are_20_degrees_apart_and_40_at_the_sides(name: str) -> None:
    """As in the figure of the user guide, the sonars go clockwise from the left."""
    front = [90, 50, 30, 10, -10, -30, -50, -90]
    expected = front + [-180 - it if it <= 0 else 180 - it for it in reversed(front)]

    assert headings(name, "so") == pytest.approx(expected, abs=0.1)


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


def test_the_car_has_the_wheels_that_its_documentation_names() -> None:
    """A client computes the steering angles from wheelbase and track."""
    body = described("BmwX5").body
    wheels = {
        wheel.text("name"): wheel
        for wheel in of_type(body.walk(), "Solid")
        if (wheel.text("name") or "").endswith("wheel")
    }
    hubs = [it for it in of_type(body.walk(), "Solid") if (it.text("name") or "").endswith("hub")]
    rear = {numbers(wheels[f"rear {it} wheel"], "translation")[1] for it in ("left", "right")}

    assert {numbers(it, "translation") for it in hubs} == {(2.995, 0.814, 0), (2.995, -0.814, 0)}
    assert rear == {0.814, -0.814}
    assert {
        numbers(it, "radius") for wheel in wheels.values() for it in of_type(within(wheel, body), "Cylinder")
    } == {(0.374,)}
