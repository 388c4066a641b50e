"""A robot and its scene in Webots, or in any simulator with the same ROS interface.

The names of a robot's devices and nodes are attributes of its class. So a robot with other names needs only a
short subclass, which `trainer.robot` of a job names.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import ClassVar

from palaestra_trainer.errors import (
    ConfigurationError,
    MissingCapability,
    NoReading,
    NoSuchSensor,
    WorldMisfit,
)
from palaestra_trainer.robots.base import JointScene, RobotAbc, Scene
from palaestra_trainer.robots.capabilities import Localization
from palaestra_trainer.robots.geometry import Point, Pose
from palaestra_trainer.robots.layout import FloorLayout, Obstacle
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.webots import (
    FLOOR,
    Actuator,
    Sensor,
    Stepper,
    Thing,
    Webots,
    require_node,
)

PERIOD_MS = 192  # six basic steps of 32 ms
_SQUARE = 1e-3  # greatest difference of a floor's heading from a multiple of 90 degrees, in quarters
DOT_M = 0.1  # radius of a robot in a recording if its class has no radius


class SimulatedRobot(RobotAbc):
    """A robot whose devices a simulator provides; `trainer.robot` names a subclass.

    The constructor calls `equip`, in which a subclass adds its devices.

    Args:
        webots: the simulator. Each start of the simulator connects this robot, unless a newer robot has the
            same name. If the simulator already runs, call `connect`.
        node_name: the ROS name of the robot in the world; by default the name of the supervisor, if the robot
            is its own supervisor.
        definition: the DEF name of the robot in the world; by default the DEF name of its class.
        period_ms: simulated milliseconds in one `advance`; by default the period of its class.
        robots: the ROS names of all robots in the world, which step together; by default only this robot and
            the supervisor.

    Attributes:
        definition: see above; "": the pose of the robot is not read.
        period_ms: see above; a multiple of the world's basicTimeStep.
        target: the DEF name of the mark that the scene moves to the target; None: the world does not need a
            mark.
        node_name: the actual ROS name of the robot's controller, for sensors and motors that a subclass adds.
    """

    definition: str = ""
    batched: ClassVar[type | None] = None  # the batched form of the class, see `robots.batched`
    period_ms: int = PERIOD_MS
    target: ClassVar[str | None] = "TARGET"

    def __init__(
        self,
        webots: Webots,
        node_name: str | None = None,
        definition: str | None = None,
        period_ms: int | None = None,
        robots: Iterable[str] = (),
    ) -> None:
        name = webots.name_of(node_name) if node_name else webots.robot_name
        self.node_name = name
        self.definition = type(self).definition if definition is None else definition
        self.period_ms = type(self).period_ms if period_ms is None else period_ms
        self._observer = webots.observer
        self._in_use: set[str] = set()  # the optional devices that are in use
        others = map(webots.name_of, robots)
        together = dict.fromkeys((name, webots.robot_name, *others))
        self.simulation = Stepper(tuple(together), webots.supervisor, webots.observer, self.period_ms)
        if self.definition:
            self.simulation.track(self.definition)
        self.equip()
        webots.at_start(name, self.connect, together)

    def equip(self) -> None:
        """Add sensors and motors to `simulation`; a subclass with devices overrides this method."""

    @property
    def period_s(self) -> float:
        """Seconds of simulated time in one `advance`."""
        return self.simulation.period_ms / 1000.0

    def connect(self) -> None:
        """Enable the sensors and release the motors; each start of the simulator calls this method.

        Your program must call this method if the simulator already runs when the robot is created, and after
        a world reload.

        Raises:
            WorldMisfit: the world lacks the robot's node, or the robot lacks a device of its class.
            SimulatorDead, SimulatorHung, WrongData
        """
        self.close()  # closes the connections to the previous simulator process
        self._observer.forget_handles()
        self.simulation.connect()

    def advance(self) -> int:
        """Simulate one control period; return the number of extra periods, normally 0.

        Raises:
            Paused: the simulation is paused; no request was sent.
            SimulatorDead, SimulatorHung, WrongData: as `Stepper.step`.
        """
        return self.simulation.step()

    def close(self) -> None:
        """Close all connections."""
        self.simulation.close()

    def _use(self, *parts: Sensor | Actuator) -> None:
        """Start to use optional devices.

        Raises:
            NoSuchSensor: the connected robot lacks a device, or cannot enable it.
            SimulatorDead, SimulatorHung, WrongData
        """
        for part in parts:
            try:
                if isinstance(part, Sensor):
                    self.simulation.use(part)
                else:
                    self.simulation.use_motor(part)
            except WorldMisfit as misfit:
                raise NoSuchSensor(str(misfit)) from misfit
            self._in_use.add(part.device)

    def _require_use(self, part: Sensor | Actuator, thing: str, call: str) -> None:
        if part.device not in self._in_use:
            raise NoSuchSensor(f"{self._title}: its {thing} is not in use; call {call}, then advance()")

    def _no_reading(self) -> NoReading:
        return NoReading(f"{self._title}: its sensors have sent no reading yet; call advance() first")

    @property
    def _title(self) -> str:
        return self.definition or self.node_name


class MobileRobot(SimulatedRobot, Localization):
    """A simulated robot that drives over a floor."""

    def pose(self) -> Pose:
        """Return the true pose after the last step."""
        return Pose(*self.simulation.pose(self.definition))

    def last_pose(self) -> Pose | None:
        """Return the pose that the last step read, without a new request; None before the first step."""
        known = self.simulation.known_pose(self.definition) if self.definition else None
        return None if known is None else Pose(*known)


class SimulatedScene(Scene, JointScene):
    """The scene around a simulated robot; each start of the simulator checks that the mark exists.

    Args:
        webots: the simulator.
        robot: the robot that the scene places.
        target: the DEF name of the mark on the floor; by default the `target` of the robot's class.

    Attributes:
        supervisor: the supervisor, which changes other parts of the world, such as fields of nodes.
        observer: the observer, which reads the state of the world.
        resets: number of resets since the simulator was last started.
    """

    def __init__(self, webots: Webots, robot: SimulatedRobot, target: str | None = None) -> None:
        self.supervisor = webots.supervisor
        self.observer = webots.observer
        self._robot = robot
        self._target = target or robot.target
        self._put: dict[str, tuple[float, float, float]] = {}  # positions that `put` set since `begin`
        self._floor: FloorLayout | None = None
        self._aim: Point | None = None
        self.resets = 0
        if self._target:
            mark = self._target
            webots.at_start(f"mark {mark}", lambda: require_node(webots.observer, mark))

    def begin(self, seed: int) -> None:
        """Reset the simulation: move all objects to their initial positions, at rest.

        Raises:
            Paused: the simulation is paused; the world was not changed.
            SimulatorDead, SimulatorHung, WrongData
        """
        self.resets += 1
        self._put.clear()
        self._floor = self._aim = None
        self._robot.simulation.reset(seed)

    def layout(self) -> FloorLayout:
        """Return the floor and the current objects on it; `webots.obstacles` lists the kinds of objects.

        Raises:
            WorldMisfit: the world has no floor.
            SimulatorDead, SimulatorHung, WrongData
        """
        self._floor = layout_of(
            thing if thing.name == FLOOR else thing._replace(place=self._put.get(thing.name, thing.place))
            for thing in self.observer.things()
        )
        return self._floor

    def place(self, start: Pose, target: Point) -> None:
        """Put the robot at `start`, at rest, and the mark at `target` (x, y in meters); update all readings.

        Raises:
            MissingCapability: the robot's class has no DEF name.
            Paused: the simulation is paused.
            SimulatorDead, SimulatorHung
            WrongData: also if the world lacks the node of the robot or of the mark.
        """
        name = self._robot.definition
        if not name:
            raise MissingCapability(
                f"{type(self._robot).__name__}: `definition` is empty; "
                "set it to the DEF name of the robot in the world"
            )
        self.supervisor.place(name, start.x_m, start.y_m, start.heading_rad)
        self.mark(target)
        self.supervisor.stop_inertia(name)
        self._robot.advance()

    def mark(self, target: Point) -> None:
        """Move the mark, if the robot's world has a mark, to `target` (x, y in meters) in the next period.

        Raises:
            SimulatorDead, SimulatorHung
            WrongData: also if the world lacks the node of the mark.
        """
        self._aim = target
        if self._target:
            self.supervisor.place(self._target, *target)

    def put(self, name: str, place: tuple[float, float, float]) -> None:
        """Move the node with DEF `name` to x, y, z (meters) in the next period; `begin` undoes this.

        Raises:
            SimulatorDead, SimulatorHung
            WrongData: the world lacks the node, or the simulator refuses to move it.
        """
        self.supervisor.set_field(name, "translation", place)
        self._put[name] = place

    def sight(self) -> Sight | None:
        """Return the known positions of robot and target; None: the robot does not drive on a floor."""
        robot = self._robot
        pose = robot.last_pose() if isinstance(robot, MobileRobot) else None
        if pose is None:
            return None
        radius_m = getattr(robot, "radius_m", DOT_M)
        return Sight(
            pose=pose, target=self._aim, floor=self._floor, radius_m=radius_m, period_s=robot.period_s
        )

    def set_joint(self, name: str, position: float) -> None:
        """Set the position of the joint with DEF `name` (radians or meters), at rest; `begin` undoes it.

        Raises:
            SimulatorDead, SimulatorHung
            WrongData: the world lacks the joint, or the simulator refuses to move it.
        """
        self.supervisor.set_joint(name, position)


def layout_of(things: Iterable[Thing]) -> FloorLayout:
    """Return the layout of objects, of which one is the floor.

    Raises:
        ConfigurationError: the floor has no box, or its sides are not along the axes of the world.
    """
    low, high, obstacles = (0.0, 0.0), (0.0, 0.0), list[Obstacle]()
    for thing in things:
        if thing.name == FLOOR:
            low, high = _corners(thing)
        else:
            obstacles += _obstacles(thing)
    return FloorLayout(low=low, high=high, obstacles=tuple(obstacles))


def _corners(floor: Thing) -> tuple[Point, Point]:
    """Return the lowest and the highest x and y of the floor."""
    quarters = floor.heading_rad / (0.5 * math.pi)
    if abs(quarters - round(quarters)) > _SQUARE:
        raise ConfigurationError(
            f"world: the floor is turned by {floor.heading_rad:.3f} rad about z, so its sides are not along x"
            " and y; turn it by a multiple of 90 degrees"
        )
    box = next((shape for shape in _obstacles(floor) if not shape.radius_m), None)
    if box is None:
        raise ConfigurationError("world: the floor is round; give its Solid a Box as its boundingObject")
    along, across = box.half_m if round(quarters) % 2 == 0 else reversed(box.half_m)
    return (box.x_m - along, box.y_m - across), (box.x_m + along, box.y_m + across)


def _obstacles(thing: Thing) -> list[Obstacle]:
    """Return the shapes of an object as obstacles."""
    c, s = math.cos(thing.heading_rad), math.sin(thing.heading_rad)
    found = []
    for shape in thing.shapes:
        x, y, z = shape.center
        z_m = thing.place[2] + z
        found.append(
            Obstacle(
                name=thing.name,
                x_m=thing.place[0] + x * c - y * s,
                y_m=thing.place[1] + x * s + y * c,
                bottom_m=z_m - shape.half[2],
                top_m=z_m + shape.half[2],
                half_m=shape.half[:2],
                radius_m=shape.radius_m,
                heading_rad=thing.heading_rad,
            )
        )
    return found
