"""The copies of one robot in a simulator with many copies of its world: readings and commands are arrays.

Each class is the batched form of a robot class, whose class attributes it uses: names of devices, the period.
Row i of every array belongs to copy i. The numbers of a row equal those of the single robot bit by bit.
"""

from __future__ import annotations

import math
from abc import abstractmethod
from collections.abc import Mapping, Sequence
from itertools import repeat
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from palaestra_protocol.batch import PLACE_VALUES, BatchDescription, BatchRequest, BatchShape
from palaestra_protocol.obstacle_shapes import ObstacleShape
from palaestra_trainer.errors import ConfigurationError, NoReading
from palaestra_trainer.robots.base import SENSOR_RANGE_M
from palaestra_trainer.robots.batch_link import BatchLink, BatchReading, BatchReset
from palaestra_trainer.robots.batched_base import (
    BatchedJointsAbc,
    BatchedRobotAbc,
    BatchedRobotinoAbc,
    BatchedSceneAbc,
    Floats,
    Rows,
)
from palaestra_trainer.robots.geometry import Pose
from palaestra_trainer.robots.infrared import LEAST_VOLTS, RANGE_EXPONENT, RANGE_OFFSET_M, RANGE_SCALE
from palaestra_trainer.robots.joints import JointRobot
from palaestra_trainer.robots.layout import FloorLayout
from palaestra_trainer.robots.robotino import Robotino, wheel_speeds
from palaestra_trainer.robots.simulated import SimulatedRobot, layout_of
from palaestra_trainer.webots import Thing
from palaestra_trainer.webots.fields import turn_about_z
from palaestra_trainer.webots.obstacles import FLOOR, FLOOR_REMEDY


class BatchedRobot(BatchedRobotAbc):
    """The copies of a robot; a subclass gives readings and commands a meaning.

    Args:
        robot: the class of the single robot.
        link: the connection to the simulator.
        rows: the number of copies.

    Attributes:
        kind: the class of the single robot.
        rows: see above.
        period_s: simulated seconds of one `advance`.
        failed: for each row, whether its copy failed since its last reset: its readings are not valid.
        reasons: the reasons of failures, by row; a failed row may lack a reason.
        simulated_s: seconds of simulated time of all rows together.
    """

    def __init__(self, robot: type[SimulatedRobot], link: BatchLink, rows: int) -> None:
        self.kind, self.rows = robot, rows
        self.period_s = robot.period_ms / 1000.0
        self.failed: NDArray[np.bool_] = np.zeros(rows, dtype=bool)
        self.reasons: Mapping[int, str] = {}
        self.simulated_s = 0.0
        self._link = link
        self._request = self.request()
        self._commands = np.full((rows, len(self._request.motors)), np.nan)
        self._values: Floats | None = None
        self._poses: Floats = np.zeros((rows, 3))

    @abstractmethod
    def request(self) -> BatchRequest:
        """Return the devices that the robot uses."""

    def released(self) -> float:
        """Return the command of a motor after a reset; NaN: no command."""
        return math.nan

    def connect(self, address: str, joints: Sequence[str] = ()) -> BatchDescription:
        """Connect to the simulator; a scene sets the positions of `joints` at resets.

        Raises:
            ConfigurationError: the simulator has another number of copies.
            WorldMisfit, SimulatorDead, SimulatorHung, WrongData
        """
        content = {**self._request.to_json(), "joints": list(joints)}
        description = self._link.open(address, BatchRequest.from_json(content))
        if description.rows != self.rows:
            raise ConfigurationError(
                f"{self._link.name}: simulates {description.rows} copies, and the configuration has"
                f" {self.rows}; write the same number in both"
            )
        self._values = None
        self.failed, self.reasons = np.zeros(self.rows, dtype=bool), {}
        return description

    def close(self) -> None:
        """Close the connection; further calls have no effect."""
        self._link.close()

    def advance(self) -> None:
        """Simulate one period of all rows.

        Raises:
            SimulatorDead, SimulatorHung, WrongData
        """
        reading = self._link.step(self._commands)
        self._values, self._poses = reading.values, reading.poses
        self.failed, self.reasons = reading.failed, reading.reasons
        self.simulated_s += self.period_s * self.rows

    def restart(self, reset: BatchReset) -> None:
        """Reset rows and simulate one period of these rows; for a scene.

        Raises:
            SimulatorDead, SimulatorHung, WrongData
        """
        reading = self._link.reset(reset)
        self._commands[reset.rows] = reset.commands
        self._put(reset.rows, reading)
        self.simulated_s += self.period_s * len(reset.rows)

    def poses(self) -> Floats:
        """Return x and y in meters and the heading in radians of each row's robot: (rows, 3)."""
        return self._poses

    def values(self) -> Floats:
        """Return the readings of the sensors of `request`: (rows, sensors).

        Raises:
            NoReading: no row was reset or stepped yet.
        """
        if self._values is None:
            raise NoReading(f"{self._link.name}: its sensors have sent no reading yet; reset the rows first")
        return self._values

    def _put(self, rows: Rows, reading: BatchReading) -> None:
        values = np.zeros((self.rows, reading.values.shape[1])) if self._values is None else self._values
        # Copies, because the arrays of the last step may still be used.
        self._values, self._poses, self.failed = values.copy(), self._poses.copy(), self.failed.copy()
        self._values[rows], self._poses[rows], self.failed[rows] = reading[:3]
        self.reasons = reading.reasons


class BatchedRobotino(BatchedRobot, BatchedRobotinoAbc):
    """The copies of a Robotino; the arguments are those of `BatchedRobot`."""

    kind: type[Robotino]
    _meters: NDArray[np.float32] | None = None

    def request(self) -> BatchRequest:
        """Return the wheels, the distance sensors and the bumper."""
        kind = self.kind
        return BatchRequest(
            period_ms=kind.period_ms,
            motors=kind.wheels,
            commanded="velocity",
            sensors=(*kind.infrared, kind.bumper),
            robot=kind.definition,
            mark=kind.target or "",
        )

    @property
    def radius_m(self) -> float:
        """The radius of a robot's outline."""
        return self.kind.radius_m

    def released(self) -> float:
        """Return 0: after a reset the wheels stand."""
        return 0.0

    def drive(self, vx: Floats, vy: Floats, omega: Floats) -> None:
        """Set the velocities until the next command: forward, left (m/s), counter-clockwise (rad/s)."""
        self._commands = np.stack(wheel_speeds(vx, vy, omega), axis=1)

    def advance(self) -> None:
        """Simulate one period of all rows; see `BatchedRobot`."""
        super().advance()
        self._meters = None

    def restart(self, reset: BatchReset) -> None:
        """Reset rows and simulate one period of these rows; see `BatchedRobot`."""
        super().restart(reset)
        if self._meters is not None:  # the other rows keep their distances
            self._meters = self._meters.copy()
            self._meters[reset.rows] = self._converted(self.values()[reset.rows, :-1])

    def distances(self) -> NDArray[np.float32]:
        """Return meters to the nearest obstacles, (rows, 9), counter-clockwise from forward."""
        if self._meters is None:
            self._meters = self._converted(self.values()[:, :-1])
        return self._meters

    @staticmethod
    def _converted(readings: Floats) -> NDArray[np.float32]:
        # The single robot gets each value in a message, which has 32 bits for the value.
        volts = np.maximum(readings.astype(np.float32).astype(np.float64), LEAST_VOLTS)
        # Python's power is used, because NumPy's power may differ in the last bit.
        powers = np.fromiter(map(pow, volts.ravel().tolist(), repeat(RANGE_EXPONENT)), float, volts.size)
        meters = RANGE_SCALE * powers.reshape(volts.shape) + RANGE_OFFSET_M
        return np.minimum(np.maximum(meters, SENSOR_RANGE_M[0]), SENSOR_RANGE_M[1]).astype(np.float32)

    def bumped(self) -> NDArray[np.bool_]:
        """Return for each row whether its bumper touches something."""
        touched: NDArray[np.bool_] = self.values()[:, -1] != 0.0
        return touched


class BatchedJointRobot(BatchedRobot, BatchedJointsAbc):
    """The copies of a robot with joints; the arguments are those of `BatchedRobot`."""

    kind: type[JointRobot]

    def request(self) -> BatchRequest:
        """Return the motors and sensors of the class."""
        kind = self.kind
        return BatchRequest(
            period_ms=kind.period_ms, motors=kind.motors, commanded=kind.commanded, sensors=kind.sensors
        )

    @property
    def greatest(self) -> Floats:
        """The greatest command of each motor: (motors,)."""
        return np.array(self.kind.greatest)

    def joints(self) -> Floats:
        """Return the readings of the sensors: (rows, sensors)."""
        return self.values()

    def command(self, values: Floats) -> None:
        """Set the commands of the motors (rows, motors), clipped to `greatest`, until the next command."""
        most = self.greatest
        self._commands = np.minimum(np.maximum(np.asarray(values, np.float64), -most), most)


class BatchedScene(BatchedSceneAbc):
    """The scene around the copies of a robot.

    Args:
        robot: the copies.

    Attributes:
        resets: the number of resets of rows.
    """

    def __init__(self, robot: BatchedRobot) -> None:
        self.resets = 0
        self._robot = robot
        self._joints: tuple[str, ...] = ()
        self._layout: FloorLayout | None = None

    def use_joints(self, *names: str) -> None:
        """Name the joints whose positions `begin` sets; see `BatchedSceneAbc`."""
        self._joints = names

    def connect(self, address: str) -> None:
        """Connect the robot, and read the layout of the world."""
        description = self._robot.connect(address, self._joints)
        floored = any(shape.name == FLOOR for shape in description.shapes)
        self._layout = _layout(description.shapes) if floored else None

    def layout(self) -> FloorLayout:
        """Return the floor and the objects on it, which are the same in every row.

        Raises:
            ConfigurationError: the world has no floor.
        """
        if self._layout is None:
            raise ConfigurationError(f"world: has no floor; {FLOOR_REMEDY}")
        return self._layout

    def begin(
        self,
        rows: Rows,
        seeds: Sequence[int],
        *,
        starts: Sequence[Pose] | None = None,
        joints: Floats | None = None,
        commands: Floats | None = None,
    ) -> None:
        """Begin an episode in rows and simulate one period of these rows; see `BatchedSceneAbc`."""
        request, count = self._robot.request(), len(rows)
        motors = len(request.motors)
        places = [(at.x_m, at.y_m, *turn_about_z(at.heading_rad).values()) for at in starts or ()]
        released = np.full((count, motors), self._robot.released())
        reset = BatchReset(
            rows=rows,
            seeds=np.array(seeds, np.int64),
            places=np.array(places, np.float64),
            joints=np.zeros((count, 0)) if joints is None else joints,
            commands=released if commands is None else commands,
        )
        _require("seeds", reset.seeds, (count,))
        _require("starts", places, (count, PLACE_VALUES) if request.robot else (0,))
        _require("joints", reset.joints, (count, len(self._joints)))
        _require("commands", reset.commands, (count, motors))
        self.resets += count
        self._robot.restart(reset)


BATCHED_FORMS: Final[tuple[tuple[type[SimulatedRobot], type[BatchedRobot]], ...]] = (
    (Robotino, BatchedRobotino),
    (JointRobot, BatchedJointRobot),
)


def batched_form(robot: type[SimulatedRobot]) -> type[BatchedRobot]:
    """Return the batched form of a robot class: its attribute `batched`, or the form of its shipped ancestor.

    A class that overrides a method of a shipped class needs its own form, because the shipped form would not
    call that method.

    Raises:
        ConfigurationError: the class has no batched form.
    """
    own = robot.__dict__.get("batched")
    if isinstance(own, type) and issubclass(own, BatchedRobot):
        return own
    for single, form in BATCHED_FORMS:
        if issubclass(robot, single):
            if method := _overridden(robot, single):
                raise ConfigurationError(
                    f"trainer.robot: {robot.__name__} overrides {method}, which its batched form would not"
                    " use; set its attribute batched to a subclass of BatchedRobot, or remove batch"
                )
            return form
    known = " or ".join(single.__name__ for single, _ in BATCHED_FORMS)
    raise ConfigurationError(
        f"trainer.robot: {robot.__name__} has no batched form; derive it from {known}; or set its attribute"
        " batched to a subclass of BatchedRobot, or remove batch"
    )


def _overridden(robot: type[Any], single: type[Any]) -> str:
    """Return a method or property that a class between `robot` and `single` defines; "" without one."""
    between = robot.__mro__[: robot.__mro__.index(single)]
    members = ((name, value) for each in between for name, value in vars(each).items())
    return next((name for name, value in members if callable(value) or isinstance(value, property)), "")


def _require(argument: str, given: Any, shape: tuple[int, ...]) -> None:
    """Raise a ConfigurationError if an argument of `BatchedScene.begin` has another shape."""
    if np.shape(given) != shape:
        raise ConfigurationError(
            f"the batched environment gives scene.begin() {argument} of the shape {np.shape(given)}, but the"
            f" rows need {shape}; correct its call"
        )


def _layout(shapes: Sequence[BatchShape]) -> FloorLayout:
    things: dict[tuple[str, float, float, float, float], list[ObstacleShape]] = {}
    for it in shapes:
        shape = ObstacleShape(
            (it.center_x, it.center_y, it.center_z), (it.half_x, it.half_y, it.half_z), it.radius
        )
        things.setdefault((it.name, it.x, it.y, it.z, it.heading_rad), []).append(shape)
    return layout_of(
        Thing(name, (x, y, z), heading, tuple(parts)) for (name, x, y, z, heading), parts in things.items()
    )
