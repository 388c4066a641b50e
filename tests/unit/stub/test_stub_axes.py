"""Worlds whose y axis points up: the same motion and readings, in the axes of the file."""

import math

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.scene.nodes.growing import Descriptions
from palaestra_sim.scene.reading import LeaveOut
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin_protos, parse
from palaestra_sim.world.stand_ins import shipped

LYING = "1 0 0 -1.5707963267948966"  # of what stands along z, in a world whose y axis points up
E_PUCK = """E-puck { translation %s rotation %s controller "ros" controllerArgs [ "--name=a" "--synchronize" ]
  turretSlot [ GPS { } ] }"""
WALL = "Solid { translation %s boundingObject Box { size %s } }"
FLOOR = "Solid { rotation %s boundingObject Plane { } }"
TWINS = {
    "ENU": [FLOOR % "0 0 1 0", E_PUCK % ("1 2 0", "0 0 1 0"), WALL % ("1.1 2 0.05", "0.01 1 0.1")],
    "NUE": [FLOOR % LYING, E_PUCK % ("1 0 -2", LYING), WALL % ("1.1 0.05 -2", "0.01 0.1 1")],
}


def load(text, header="R2023b", leave_out=None):
    """The simulation of a world that may use what ships."""
    world = parse(f"#VRML_SIM {header} utf8\n{text}".encode(), "my.wbt")
    descriptions = Descriptions(protos=builtin_protos(), stand_ins=shipped())
    return Simulation.of(world, StubPhysics(), "my.wbt", descriptions=descriptions, leave_out=leave_out)


def load_twin(system):
    """The same E-puck before the same wall, in a world with these axes."""
    info = f'WorldInfo {{ basicTimeStep 16 coordinateSystem "{system}" }}'
    return load("\n".join([info, *TWINS[system]]))


def y_up(vector):
    """A vector of a world whose z axis points up, in one whose y axis does."""
    x, y, z = vector
    return x, z, -y


def drive(simulation, left, right, steps=20):
    """Drive the E-puck with these speeds of its wheels."""
    (robot,) = simulation.robots
    for name, speed in (("left wheel motor", left), ("right wheel motor", right)):
        robot.motors[name].set_position(math.inf)
        robot.motors[name].set_velocity(speed)
    for _ in range(steps):
        simulation.step(16)
    return robot


@pytest.mark.parametrize(("left", "right"), [(3.0, 3.0), (-3.0, -2.0), (2.0, -2.0)])
def test_a_robot_drives_and_sees_alike_whichever_axis_points_up(left, right):
    """Only the axes in which clients see it differ."""
    twin, robot = (drive(load_twin(system), left, right) for system in ("ENU", "NUE"))

    assert robot.place.translation == pytest.approx(y_up(twin.place.translation))
    assert robot.sensors["gps"].value == pytest.approx(y_up(twin.sensors["gps"].value))
    for name in ("gyro", "accelerometer"):
        assert robot.sensors[name].value == pytest.approx(twin.sensors[name].value, abs=1e-9)
    assert robot.motion(robot.place).velocity == pytest.approx(y_up(twin.motion(twin.place).velocity))
    assert robot.sensors["ps0"].value == twin.sensors["ps0"].value
    assert robot.place.height_m == 0.0


def test_a_supervisor_places_a_robot_in_the_axes_of_the_file():
    """A field that is written is read back; a reset returns to the file."""
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
    """A supervisor compares them with positions of nodes."""
    simulation = load_twin("NUE")
    robot = drive(simulation, 6.0, 6.0, steps=200)
    ((point, _),) = simulation.contact_points(robot.parts.node, descendants=True)

    assert point[0] == pytest.approx(1.095)
    assert point[1] == pytest.approx(robot.body.heights[0], abs=1e-9)
    assert point[2] == pytest.approx(-2.0)


def test_a_robot_that_lies_in_a_world_is_refused():
    """Its wheels would not reach the floor."""
    lying = E_PUCK % ("0 0 0", "0 0 1 0")

    with pytest.raises(WorldError, match="a robot that drives, but does not stand upright"):
        load(f'WorldInfo {{ coordinateSystem "NUE" }} {lying}')


def test_what_is_added_stands_in_the_axes_of_the_file():
    """Both come from the same author."""
    simulation = load('WorldInfo { coordinateSystem "EUN" }')
    root = simulation.tree.root
    children = simulation.tree.field_of(root, "children", simulation)
    simulation.add("Solid { translation 1 2 3 boundingObject Box { } }", children, -1)

    assert simulation.scene.solids[0].pose.position == (1.0, -3.0, 2.0)


def test_an_unknown_system_of_axes_is_a_mistake():
    """Webots knows three."""
    with pytest.raises(WorldError, match='coordinateSystem "UP" is none of ENU, NUE, EUN; write one of them'):
        load('WorldInfo { coordinateSystem "UP" }', leave_out=LeaveOut(everything=True))


def test_an_old_world_that_is_read_all_the_same_stands_on_its_floor():
    """Until R2022a, y was up by default, and the parts of Webots' own PROTOs stood along it."""
    old = load("WorldInfo { } WoodenBox { size 1 2 3 }", "R2021a", LeaveOut(types=frozenset({"WorldInfo"})))
    (box,) = old.scene.solids

    assert box.pose.rotation[4] == pytest.approx(1.0)
    assert sorted(box.size) == [1.0, 2.0, 3.0]
