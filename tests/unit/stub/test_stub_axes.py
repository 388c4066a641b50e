"""Worlds whose y axis points up: motions and readings are the same, in the axes of the file."""

import math

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.geometry import turn
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.field_types import FieldType
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin_protos, parse
from palaestra_sim.world.stand_ins import shipped

LYING = "1 0 0 -1.5707963267948966"  # this rotation lays a solid along z, in a world whose y axis points up
E_PUCK = """E-puck { translation %s rotation %s controller "ros" controllerArgs [ "--name=a" "--synchronize" ]
  turretSlot [ GPS { } ] }"""
WALL = "Solid { translation %s boundingObject Box { size %s } }"
FLOOR = "Solid { rotation %s boundingObject Plane { } }"
TWINS = {
    "ENU": [FLOOR % "0 0 1 0", E_PUCK % ("1 2 0", "0 0 1 0"), WALL % ("1.1 2 0.05", "0.01 1 0.1")],
    "NUE": [FLOOR % LYING, E_PUCK % ("1 0 -2", LYING), WALL % ("1.1 0.05 -2", "0.01 0.1 1")],
}


def load(text, header="R2023b", leave_out=None):
    """Return the simulation of a world that may use the bundled PROTOs and stand-ins."""
    world = parse(f"#VRML_SIM {header} utf8\n{text}".encode(), "my.wbt")
    descriptions = Descriptions(protos=builtin_protos(), stand_ins=shipped())
    return Simulation.of(world, StubPhysics(), "my.wbt", descriptions=descriptions, leave_out=leave_out)


def load_twin(system):
    """Return the same E-puck in front of the same wall, in a world with another system of axes."""
    info = f'WorldInfo {{ basicTimeStep 16 coordinateSystem "{system}" }}'
    return load("\n".join([info, *TWINS[system]]))


def y_up(vector):
    """Return a vector, converted from axes with z up to axes with y up."""
    x, y, z = vector
    return x, z, -y


def drive(simulation, left, right, steps=20):
    """Drive the E-puck with these wheel speeds, and return its robot."""
    (robot,) = simulation.robots
    for name, speed in (("left wheel motor", left), ("right wheel motor", right)):
        robot.motors[name].set_position(math.inf)
        robot.motors[name].set_velocity(speed)
    for _ in range(steps):
        simulation.step(16)
    return robot


@pytest.mark.parametrize(("left", "right"), [(3.0, 3.0), (-3.0, -2.0), (2.0, -2.0)])
def test_a_robot_drives_and_sees_alike_whichever_axis_points_up(left, right):
    """A client reads the same motion, converted to the axes of the world."""
    twin, robot = (drive(load_twin(system), left, right) for system in ("ENU", "NUE"))

    assert robot.place.translation == pytest.approx(y_up(twin.place.translation))
    assert robot.sensors["gps"].value == pytest.approx(y_up(twin.sensors["gps"].value))
    for name in ("gyro", "accelerometer"):
        assert robot.sensors[name].value == pytest.approx(twin.sensors[name].value, abs=1e-9)
    assert robot.motion(robot.place).velocity == pytest.approx(y_up(twin.motion(twin.place).velocity))
    assert robot.sensors["ps0"].value == twin.sensors["ps0"].value
    assert robot.place.height_m == 0.0


def test_a_supervisor_places_a_robot_in_the_axes_of_the_file():
    """A supervisor reads back the value that it wrote; a reset restores the value of the file."""
    simulation = load_twin("NUE")
    (robot,) = simulation.robots
    robot.place.translation = (0.5, 0.25, 1.0)
    robot.place.rotation = (0.0, 1.0, 0.0, 0.5)

    assert robot.place.translation == (0.5, 0.25, 1.0)
    assert robot.place.ground_pose.position == (0.5, -1.0, 0.25)

    robot.reset()

    assert robot.place.translation == (1.0, 0.0, -2.0)
    assert robot.place.rotation == pytest.approx((-1.0, 0.0, 0.0, math.pi / 2.0))


def test_contact_points_are_in_the_axes_of_the_file():
    """A supervisor compares contact points with positions of nodes, which are in the same axes."""
    simulation = load_twin("NUE")
    robot = drive(simulation, 6.0, 6.0, steps=200)
    ((point, _),) = simulation.contact_points(robot.parts.node, descendants=True)

    assert point[0] == pytest.approx(1.095)
    assert point[1] == pytest.approx(robot.body.heights[0], abs=1e-9)
    assert point[2] == pytest.approx(-2.0)


def test_a_robot_that_lies_in_a_world_is_refused():
    """The wheels of a robot that lies on its side would not touch the floor."""
    lying = E_PUCK % ("0 0 0", "0 0 1 0")

    with pytest.raises(WorldError, match="a robot that drives, but does not stand upright"):
        load(f'WorldInfo {{ coordinateSystem "NUE" }} {lying}')


def test_what_is_added_stands_in_the_axes_of_the_file():
    """The author of the added text writes it in the axes of the world."""
    simulation = load('WorldInfo { coordinateSystem "EUN" }')
    root = simulation.tree.root
    children = simulation.tree.field_of(root, "children", simulation)
    simulation.add("Solid { translation 1 2 3 boundingObject Box { } }", children, -1)

    assert simulation.scene.solids[0].pose.position == (1.0, -3.0, 2.0)


def test_an_unknown_system_of_axes_is_a_mistake():
    """Webots has exactly three systems of axes."""
    with pytest.raises(
        WorldError, match='coordinateSystem "UP" is not one of ENU, NUE, EUN; write one of them'
    ):
        load('WorldInfo { coordinateSystem "UP" }', leave_out=LeaveOut(everything=True))


def test_what_comes_with_webots_is_turned_in_an_old_world():
    """PROTOs of Webots have today's axes, so in an old world x of a box became -z, and z became y."""
    old = load("WorldInfo { } WoodenBox { translation 0 1.5 0 size 1 2 3 }", "R2021a")
    (box,) = old.scene.solids

    assert box.heights() == pytest.approx((0.0, 3.0))
    assert box.pose.rotation == pytest.approx((0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0), abs=1e-9)


WHEEL = """HingeJoint { jointParameters HingeJointParameters { axis %s anchor %s }
  device [ RotationalMotor { name "%s wheel motor" maxVelocity 9 } ]
  endPoint Solid { translation %s rotation %s boundingObject Cylinder { radius 0.02 height 0.01 } } }"""
CAR = """Robot { translation %s rotation %s controller "ros" controllerArgs [ "--name=a" "--synchronize" ]
  boundingObject Pose { translation %s children [ Box { size %s } ] }
  children [ %s %s
    DistanceSensor { translation %s rotation %s lookupTable [ 0 0 0, 9 9 0 ] }
    Lidar { translation %s maxRange 9 horizontalResolution 8 numberOfLayers 2 }
    GPS { translation %s } ] }"""
CARS = {
    "R2023b": CAR
    % (
        "1 2 0", "0 0 1 0.3", "0 0 0.04", "0.1 0.06 0.04",
        WHEEL % ("0 1 0", "0 0.05 0.02", "left", "0 0.05 0.02", "1 0 0 1.5707963"),
        WHEEL % ("0 1 0", "0 -0.05 0.02", "right", "0 -0.05 0.02", "1 0 0 1.5707963"),
        "0.06 0.01 0.03", "0 0 1 0", "0 0 0.1", "0.05 0.02 0.1",
    ),
    "R2021b": CAR
    % (
        "1 0 -2", "0 1 0 -1.2707963267948966", "0 0.04 0", "0.06 0.04 0.1",
        WHEEL % ("-1 0 0", "-0.05 0.02 0", "left", "-0.05 0.02 0", "0 0 1 1.5707963"),
        WHEEL % ("-1 0 0", "0.05 0.02 0", "right", "0.05 0.02 0", "0 0 1 1.5707963"),
        "-0.01 0.03 -0.06", "0 1 0 1.5707963267948966", "0 0.1 0", "-0.02 0.1 -0.05",
    ),
}  # fmt: skip
POSTS = {
    "R2023b": "Solid { translation 2 2.5 0.5 boundingObject Cylinder { radius 0.2 height 1 } }",
    "R2021b": "Solid { translation 2 0.5 -2.5 boundingObject Cylinder { radius 0.2 height 1 } }",
}  # fmt: skip
FORWARD = {"R2023b": (1.0, 0.0, 0.0), "R2021b": (0.0, 0.0, -1.0)}


def load_car(release):
    """Return the same car in front of the same post, in a world of a release with that release's axes."""
    return load(f"WorldInfo {{ basicTimeStep 16 }} {CARS[release]} {POSTS[release]}", release)


@pytest.mark.parametrize(("left", "right"), [(3.0, 3.0), (-3.0, -2.0), (2.0, -2.0)])
def test_a_world_of_old_axes_is_the_same_world(left, right):
    """In an old world, robots looked along -z, y pointed up, and cylinders stood along y.

    Webots converts such a world when it loads the file.
    """
    twin, robot = (drive(load_car(release), left, right) for release in CARS)
    places = [it.parts.node.place for it in (twin, robot)]

    assert places[1].translation == pytest.approx(y_up(places[0].translation), abs=1e-6)
    ahead = [
        turn(place.world_pose.rotation, axis) for place, axis in zip(places, FORWARD.values(), strict=True)
    ]
    assert ahead[1] == pytest.approx(y_up(ahead[0]), abs=1e-6)
    assert robot.sensors["gps"].value == pytest.approx(y_up(twin.sensors["gps"].value), abs=1e-6)
    assert robot.sensors["distance sensor"].value == pytest.approx(twin.sensors["distance sensor"].value)
    assert robot.motion(robot.place).velocity == pytest.approx(y_up(twin.motion(twin.place).velocity))
    lidars = [it.parts.devices.rows["lidar"][1] for it in (twin, robot)]
    assert [list(row) for row in lidars[1].layers] == [pytest.approx(list(row)) for row in lidars[0].layers]


def test_a_supervisor_turns_a_robot_of_old_axes_in_the_axes_of_the_file():
    """The supervisor reads the rotation that it wrote, and the robot looks along its own -z axis."""
    (robot,) = load_car("R2021b").robots
    place = robot.parts.node.place
    start = place.translation, place.rotation
    place.translation, place.rotation = (0.5, 0.25, 1.0), (0.0, 1.0, 0.0, 0.5)

    assert place.translation == pytest.approx((0.5, 0.25, 1.0))
    assert place.rotation == pytest.approx((0.0, 1.0, 0.0, 0.5))
    assert (robot.body.x, robot.body.y) == pytest.approx((0.5, -1.0))
    assert turn(place.world_pose.rotation, (0.0, 0.0, -1.0)) == pytest.approx(
        (-math.sin(0.5), 0.0, -math.cos(0.5))
    )

    robot.reset()

    assert (place.translation, place.rotation) == (pytest.approx(start[0]), pytest.approx(start[1]))


def test_a_robot_of_webots_drives_in_an_old_world():
    """The PROTO has today's axes, so Webots and the stub turn the instance in an old world."""
    forward = "0 1 0 -1.5707963267948966"  # -z of the robot is x of the world
    wall = WALL % ("1.1 0.05 -2", "0.01 0.1 1")
    old = load(f"WorldInfo {{ basicTimeStep 16 }} {E_PUCK % ('1 0 -2', forward)} {wall}", "R2021b")
    twin, robot = drive(load_twin("ENU"), 3.0, 3.0), drive(old, 3.0, 3.0)

    assert robot.place.translation == pytest.approx(y_up(twin.place.translation))
    assert robot.sensors["ps0"].value == pytest.approx(twin.sensors["ps0"].value)


@pytest.mark.parametrize(
    ("system", "upright"),
    [("ENU", (0.0, 0.0, 1.0, 0.4)), ("NUE", (1.0, 0.0, 0.0, -math.pi / 2.0))],
    ids=["z points up", "y points up"],
)
def test_a_rotation_that_tilts_a_robot_is_refused(system, upright):
    """The robot can only turn, so it would have another rotation than the one that the client reads back."""
    simulation = load_twin(system)
    [robot] = simulation.robots
    field = simulation.tree.field_of(robot.parts.node, "rotation", simulation)

    field.set(FieldType.ROTATION, 0, upright)
    with pytest.raises(UnsimulatedError, match="this rotation tilts a robot that drives"):
        field.set(FieldType.ROTATION, 0, (1.0, 0.0, 0.0, 0.5))
