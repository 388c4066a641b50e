"""Robots and scenes in simulators: the nodes that a class names exist, and the layout is the world's."""

from collections import Counter
from itertools import product

import pytest
from structlog.testing import capture_logs

from palaestra_protocol.obstacle_shapes import MOST_POINTS
from palaestra_sim.mujoco.batched.shapes import shapes_of
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.stub.physics import StubPhysics
from palaestra_sim.world import builtin
from palaestra_trainer.environments import MoveToTargetEnv
from palaestra_trainer.errors import NoSuchSensor, WorldMisfit
from palaestra_trainer.robots import Pose
from palaestra_trainer.robots.differential import EPuck, TurtleBot3Burger
from palaestra_trainer.robots.robotino import Robotino
from palaestra_trainer.robots.simulated import SimulatedScene
from palaestra_trainer.testing import check_robot, check_scene, fake_pen
from palaestra_trainer.testing.fake_burger import COURT
from palaestra_trainer.testing.fake_epuck import PEN
from palaestra_trainer.testing.fake_scene import arena as fake_floor
from palaestra_trainer.webots import FLOOR, Webots
from palaestra_trainer.webots.obstacles import ObstacleReader
from palaestra_trainer.webots.services import Services

START, TARGET = Pose(0.0, 0.0, 1.0), (1.0, 0.0)
FITTED = b"""
    Lidar {
      translation 0.1 0 0.25
      name "laser"
      numberOfLayers 1
      horizontalResolution 44
      fieldOfView 3.84
      maxRange 20
    }
    SliderJoint {
      jointParameters JointParameters { axis 0 0 1 }
      device [ LinearMotor { name "fork" maxPosition 0.15 } PositionSensor { name "fork height" } ]
      endPoint Solid { name "tines" }
    }
    SliderJoint {
      jointParameters JointParameters { axis 0 1 0 }
      device [ LinearMotor { name "gripper left" maxPosition 0.03 } ]
      endPoint Solid { name "left finger" }
    }
    SliderJoint {
      jointParameters JointParameters { axis 0 -1 0 }
      device [ LinearMotor { name "gripper right" maxPosition 0.03 } ]
      endPoint Solid { name "right finger" }
    }
"""
TURNED = b"""
DEF TURNED Solid { translation 5 5 0.5 rotation 0 0 1 0.5 name "turned" boundingObject Group { children [
  Pose { translation 0.1 0.2 0 rotation 0 0 1 0.7 children Shape { geometry Box { size 0.3 0.1 0.2 } } }
  Transform { translation 0.5 0 0 scale 2 3 1 children Box { } }
  Pose { translation 0 1 0 rotation 1 0 0 1.5707963 children Cylinder { radius 0.1 height 0.4 } }
  Sphere { radius 0.1 } ] } }
DEF WEDGE Solid { translation -5 5 0.5 rotation 0 0 1 0.5 name "wedge" boundingObject Pose {
  translation 0.1 0.2 0 rotation 0 0 1 0.7 children IndexedFaceSet {
    coord Coordinate { point [ 0 0 0, 1 0 0, 0 2 0, 0 0 0.5 ] }
    coordIndex [ 0 2 1 -1 0 1 3 -1 1 2 3 -1 2 0 3 -1 ] } } }
"""
GRID = product(range(MOST_POINTS // 40 + 1), range(40))
POINTS = ", ".join(f"{x / 100} {y / 100} {x * y % 7 / 100}" for x, y in GRID)  # more than a reader requests
FINE = f"""DEF FINE Solid {{ translation -5 -5 0.5 boundingObject IndexedFaceSet {{
  coord Coordinate {{ point [ {POINTS} ] }} coordIndex [ 0 1 40 -1 1 41 40 -1 ] }} }}
""".encode()


class Noting(Services):
    """Services of a running simulator; they record the paths of all requests."""

    def __init__(self, node_name):
        super().__init__(node_name)
        self.asked = []

    def get(self, path, type_name):
        """Record the path, and return the service."""
        self.asked.append(path)
        return super().get(path, type_name)


@pytest.fixture
def running(master, tmp_path):
    """Yield `running(robot class, world, supervisor)`, which returns a robot and its scene in a stub."""
    del master
    started = []

    def start(kind, source, supervisor):
        world = tmp_path / "changed.wbt"
        world.write_bytes(source)
        webots = Webots(supervisor, world, start_deadline_s=20.0)
        robot = kind(webots)
        started.append((webots, robot))
        scene = SimulatedScene(webots, robot)
        webots.__enter__()
        return robot, scene

    yield start
    for webots, robot in started:
        robot.close()
        webots.stop()
        webots.close()


@pytest.mark.parametrize(
    ("kind", "world", "near"),
    [(TurtleBot3Burger, "court", START), (EPuck, "pen", Pose(-0.3, 0.0, 1.0))],
    ids=["burger", "e-puck"],
)
def test_a_robot_on_two_wheels_passes_the_checks(running, kind, world, near):
    """The robot must follow its commands in the curves that two wheels permit."""
    robot, scene = running(kind, builtin(world), kind.definition.lower())

    scene.reset(1, near, TARGET)
    check_robot(robot)
    check_scene(robot, scene, near, TARGET)


def test_a_fake_e_puck_sees_what_one_in_a_simulator_sees(running):
    """If the fake saw other distances, its results would not be valid for a simulator."""
    robot, scene = running(EPuck, builtin("pen"), "epuck")
    fake, fake_scene = fake_pen()

    for near in (Pose(0.0, 0.13, 0.7), Pose(-0.54, 0.34, -2.5)):
        for each in (scene, fake_scene):
            each.reset(1, near, TARGET)

        assert fake.distances().min() < 0.03
        assert robot.distances() == pytest.approx(fake.distances(), abs=0.008)
    for name in ("radius_m", "speed_m_s", "bearings_rad", "distance_range_m", "axle_m"):
        assert getattr(fake, name) == getattr(robot, name)


def test_a_robotino_uses_what_its_world_fits_it_with(running):
    """Laser scanner, forklift and gripper are optional, and cost no time before their first use."""
    world = builtin("arena").replace(
        b"  supervisor TRUE\n  children [", b"  supervisor TRUE\n  children [" + FITTED
    )
    robot, scene = running(Robotino, world, "robotino")
    scene.reset(1, START, TARGET)

    check_robot(robot)
    robot.lift(0.1)
    robot.grip(1.0)
    for _ in range(10):
        robot.advance()

    assert robot.scan().shape == (44,)
    assert robot.scan().max() < 4.0


@pytest.mark.parametrize("use", ["use_scanner", "use_gripper", "use_forklift"])
def test_what_a_world_lacks_is_refused_by_name(arena, use):
    """The connected robot knows its devices, so a user learns at once which device the world lacks."""
    with pytest.raises(NoSuchSensor, match="the robot has no device"):
        getattr(arena.robot, use)()


@pytest.mark.parametrize(
    "call",
    [lambda it: it.scan(), lambda it: it.grip(1.0), lambda it: it.lift(0.1)],
    ids=["scan", "grip", "lift"],
)
def test_what_is_not_in_use_says_how_to_use_it(arena, call):
    """The user must get the name of the method before a request is sent."""
    with pytest.raises(NoSuchSensor, match="is not in use; call use_"):
        call(arena.robot)


def test_a_subclass_names_other_nodes_and_devices(running):
    """A user's robot has other names, and a subclass is all that a user needs to write."""

    class MyBot(Robotino):
        definition = "MYBOT"
        bumper = "front bumper"

    world = (
        builtin("arena").replace(b"DEF ROBOTINO", b"DEF MYBOT").replace(b'"touch sensor"', b'"front bumper"')
    )

    robot, scene = running(MyBot, world, "robotino")

    check_scene(robot, scene, START, TARGET)


def things(layout):
    """Return the obstacles of a floor by name, without the walls."""
    return {thing.name: thing for thing in layout.obstacles if not thing.name.startswith("WALL")}


def test_the_layout_is_that_of_the_world(arena, running):
    """The fakes must have the same floors, so that results with a fake are valid."""
    court = running(TurtleBot3Burger, builtin("court"), "burger")[1].layout()
    pen = running(EPuck, builtin("pen"), "epuck")[1].layout()

    for layout, fake in ((arena.scene.layout(), fake_floor()), (court, COURT), (pen, PEN)):
        assert (layout.low, layout.high) == (fake.low, fake.high)
        assert set(things(layout)) == set(things(fake))
        for name, thing in things(fake).items():
            seen = things(layout)[name]
            assert (seen.x_m, seen.y_m, seen.heading_rad) == pytest.approx(
                (thing.x_m, thing.y_m, thing.heading_rad)
            )
            assert (*seen.half_m, seen.radius_m, seen.top_m) == pytest.approx(
                (*thing.half_m, thing.radius_m, thing.top_m)
            )


def test_turned_and_scaled_obstacles_are_those_of_the_copies(running, caplog):
    """A policy is trained in the copies and evaluated over ROS, so both must draw the same free places."""
    world = builtin("arena").replace(b"DEF FLOOR Solid {", b"DEF FLOOR Solid { rotation 0 0 1 1.5707963")
    world += TURNED + FINE
    robot, _ = running(Robotino, world, "robotino")
    services = Noting(robot.node_name)
    try:
        with capture_logs() as logs:
            found = [
                (thing.name, *thing.place, thing.heading_rad, *shape.center, *shape.half, shape.radius_m)
                for thing in ObstacleReader(services).read()
                for shape in thing.shapes
            ]
    finally:
        services.close()
    simulation = Simulation.load(world, StubPhysics(), "world.wbt", Mode.FAST)

    assert found == [tuple(shape.to_json().values()) for shape in shapes_of(simulation)]
    counts = Counter(name for name, *_ in found)
    assert (counts["TURNED"], counts["WEDGE"], counts["FINE"]) == (4, 1, 0)
    warned = [(line["event"], line["shapes"]) for line in logs]
    assert warned == [("obstacles without a known size are not in the layout", {"IndexedFaceSet": 1})]
    assert "not in the layout: 1 IndexedFaceSet" in caplog.text


def test_the_layout_follows_a_thing_that_somebody_moved(arena):
    """The supervisor or `put` may move an obstacle, and a new episode moves it back."""
    arena.scene.supervisor.set_field("CYLINDER_0", "translation", (1.5, 0.0, 0.2))
    arena.scene.put("CYLINDER_1", (0.0, 1.5, 0.2))
    arena.robot.advance()

    moved = things(arena.scene.layout())
    arena.scene.begin(1)
    back = things(arena.scene.layout())

    assert (moved["CYLINDER_0"].x_m, moved["CYLINDER_1"].y_m) == (1.5, 1.5)
    assert (back["CYLINDER_0"].x_m, back["CYLINDER_1"].y_m) == (0.8, 0.8)


def test_a_start_is_never_drawn_inside_a_thing_that_the_world_has_elsewhere(running):
    """A world file may move an obstacle, so its position must be read from the world."""
    world = builtin("arena").replace(b"translation 0.8 0.8 0.2", b"translation 0.3 -0.1 0.2")
    robot, scene = running(Robotino, world, "robotino")
    env = MoveToTargetEnv(robot, scene)
    cylinder = things(scene.layout())["CYLINDER_0"]

    for seed in range(20):
        _, info = env.reset(seed=seed)
        assert cylinder.gap(info["start"].x_m, info["start"].y_m) >= robot.radius_m
        assert not robot.bumped()


def test_a_world_without_a_floor_is_refused(running):
    """The user must learn how to define a floor."""
    _, scene = running(
        Robotino, builtin("arena").replace(b"DEF FLOOR Solid", b"DEF GROUND Solid"), "robotino"
    )

    with pytest.raises(WorldMisfit, match="the world has no floor; write DEF FLOOR"):
        scene.layout()


def test_only_what_looks_different_when_turned_is_asked_for_its_orientation(arena):
    """Each request costs time at every reset. The first reading asks for the tilt of each object."""
    services = Noting(arena.webots.supervisor.node_name)
    try:
        reader = ObstacleReader(services)
        reader.read()
        services.asked.clear()
        things = reader.read()
    finally:
        services.close()

    turned = [thing for thing in things if thing.name != FLOOR and not thing.shapes[0].radius_m]
    assert len(turned) < len(things) - 1
    assert services.asked.count("supervisor/node/get_orientation") == len(turned)
