"""Many copies of a world in which one robot drives on wheels.

A simulation of one copy gives the model, the sensors and the state to which a reset returns. The arrays of
this module then compute the wheels, servos, contacts and rays of the robot in each copy.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from palaestra_protocol.batch import BatchDescription, BatchRequest
from palaestra_sim.mujoco.base_model import build_free
from palaestra_sim.mujoco.batched.clearance import Clearance
from palaestra_sim.mujoco.batched.rows import Rows
from palaestra_sim.mujoco.batched.scene_checks import lacks_of_request, lacks_of_world
from palaestra_sim.mujoco.batched.scene_sensors import Noise, Sensors
from palaestra_sim.mujoco.batched.shapes import shapes_of
from palaestra_sim.mujoco.batched.trigonometry import arc_tangents, cosines, sines, within_half_turn
from palaestra_sim.mujoco.batched.wheels import Bases
from palaestra_sim.mujoco.batched.world import BatchReadings, BatchRefusedError, Reset
from palaestra_sim.mujoco.body import MujocoBody
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.physics import MujocoPhysics, mujoco_steps
from palaestra_sim.scene.geometry import Pose, from_axis_angle
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.fields import quaternion_to_axis_angle
from palaestra_sim.scene.wheel_kinematics import Drive

# `_advance` checks whether a row is free for a whole basic step, then for each half, then for each quarter.
_SHARES: Final = 4
_NOTHING_TO_TOUCH: Final = int(mujoco.mjtDisableBit.mjDSBL_CONTACT | mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
_REMEDY: Final = "change the world, or remove batch from the job"


class SceneBatch:
    """`count` copies of a world; see `BatchWorld`.

    Args:
        simulation: the simulation of one copy; its physics, `MujocoPhysics(feeling=True)`, has contact
            sensors.
        name: the name of the world file, in errors.
        count: the number of copies.
        threads: the number of threads; 0: one for each processor.

    Raises:
        BatchRefusedError: the world has parts that the batch form does not simulate.
    """

    def __init__(self, simulation: Simulation, name: str, count: int, threads: int) -> None:
        if lacks := list(lacks_of_world(simulation)):
            raise BatchRefusedError(name, lacks, _REMEDY)
        self._simulation, self._name = simulation, name
        self._count, self._threads = count, threads
        [self._robot] = simulation.robots
        self._step_s = simulation.basic_step_ms / 1000.0
        self._numbers = np.arange(count)

    def open(self, request: BatchRequest) -> BatchDescription:
        """Use the devices of the request from now on; see `BatchWorld`."""
        if lacks := list(lacks_of_request(self._simulation, request)):
            raise BatchRefusedError(self._name, lacks, "change the robot of the job, or the world")
        self._simulation.reset()
        self._simulation.step(request.period_ms)
        body, physics = self._robot.body, self._simulation.scene.physics
        if not isinstance(body, MujocoBody) or not isinstance(physics, MujocoPhysics):
            raise TypeError("the world was loaded with another physics")  # `lacks_of_world` excludes this
        if any(body.velocity):
            raise BatchRefusedError(self._name, ["the robot is pushed at the start of the world"], _REMEDY)
        built = physics.built()
        self._basic_steps = request.period_ms // self._simulation.basic_step_ms
        self._steps = mujoco_steps(self._step_s)
        self._start = (body.x, body.y, body.heading_rad)
        self._height_m = self._robot.place.height_m
        self._rows = Rows(built.model, built.data, self._count, self._threads, sleeping=False)
        self._free = self._rows_without_shapes(body)
        self._timestep_s = self._step_s / self._steps
        self._clearance = Clearance(built)
        self._sensors = Sensors(self._robot, built)
        self._noise = Noise(self._count, self._sensors.draws)
        self._touched = np.zeros((self._count, self._rows.sensordata.shape[1]), dtype=bool)
        self._bases = self._new_bases(body)
        wheels = list(self._robot.motors)
        self._motors = [wheels.index(name) for name in request.motors]
        self._wheels = len(wheels)
        self._chosen = [self._sensors.names.index(name) for name in request.sensors]
        return BatchDescription(
            rows=self._count,
            basic_step_ms=self._simulation.basic_step_ms,
            units=tuple(self._sensors.units(name) for name in request.sensors),
            shapes=shapes_of(self._simulation),
        )

    def step(self, commands: Any) -> BatchReadings:
        """Simulate one period of all rows; see `BatchWorld`."""
        self._bases.command(slice(None), self._of_wheels(commands))
        return self._period(None)

    def reset(self, reset: Reset) -> BatchReadings:
        """Reset rows and simulate one period of these rows; see `BatchWorld`."""
        rows = reset.rows
        self._rows.restart(rows)
        self._bases.restart(rows, self._start)
        self._touched[rows] = False
        self._noise.sow(rows, reset.seeds)
        # Skip one sample, because the single simulation also samples once between reset and placement.
        self._noise.draw(rows)
        if reset.places.size:
            placed = np.array([_pose(place) for place in reset.places.tolist()])
            self._bases.x[rows], self._bases.y[rows], self._bases.heading_rad[rows] = placed.T
            self._rows.qpos[rows] = placed
        self._bases.command(rows, self._of_wheels(reset.commands))
        return self._period(rows)

    def _rows_without_shapes(self, body: MujocoBody) -> Rows:
        model = build_free(body, self._height_m, self._simulation.scene.surroundings)
        model.opt.timestep = self._step_s / self._steps
        model.opt.disableflags |= _NOTHING_TO_TOUCH
        return Rows(model, mujoco.MjData(model), self._count, self._threads, sleeping=False)

    def _new_bases(self, body: MujocoBody) -> Bases:
        drive = body.base.drive
        if not isinstance(drive, Drive):
            raise TypeError("the robot has no wheels")  # `lacks_of_world` excludes this
        bases = Bases(self._count, [motor.spec for motor in self._robot.motors.values()], drive)
        bases.restart(slice(None), self._start)
        return bases

    def _of_wheels(self, commands: Any) -> Any:
        """Return commands for all wheels; NaN for the wheels that the trainer does not command."""
        found = np.full((len(commands), self._wheels), np.nan)
        found[:, self._motors] = commands
        return found

    def _period(self, rows: Any) -> BatchReadings:
        for _ in range(self._basic_steps):
            self._basic_step(rows)
        return self._read(rows)

    def _basic_step(self, rows: Any) -> None:
        chosen = slice(None) if rows is None else rows
        stepped = self._rows
        stepped.ctrl[chosen] = self._bases.turn(chosen, self._step_s)
        self._advance(self._numbers[chosen], self._steps)
        positions = stepped.qpos[chosen]
        # The cosine of an infinite heading is an error; `Rows.failed` finds the row.
        self._bases.follow(chosen, np.where(np.isfinite(positions), positions, 0.0), self._step_s)

    def _advance(self, rows: Any, steps: int) -> None:
        """Take `steps` MuJoCo steps in rows, in two halves for a row whose robot may touch something."""
        stepped = self._rows
        free = self._clearance.free(stepped.qpos[rows], stepped.qvel[rows], steps * self._timestep_s)
        if free.any():
            stepped.step_as(self._free, rows[free], steps)
        close = rows[~free]
        if not len(close):
            return
        if steps > 1 and steps > self._steps // _SHARES:
            self._advance(close, steps // 2)
            self._advance(close, steps - steps // 2)
            return
        for _ in range(steps):
            stepped.step(close, 1)
            found = stepped.sensordata[close] > 0.0
            if found.any():
                self._touched[close] |= found

    def _read(self, rows: Any) -> BatchReadings:
        chosen = slice(None) if rows is None else rows
        bases = self._bases
        x, y, heading = bases.x[chosen], bases.y[chosen], bases.heading_rad[chosen]
        failed = self._rows.failed(rows)
        sound = np.where(failed, 0.0, heading)
        c, s = cosines(sound), sines(sound)
        upward = (1.0 - c) + c  # as `from_axis_angle` computes it
        positions = np.stack((x, y, np.full(len(x), self._height_m)), axis=1)
        positions[failed] = 0.0
        cast = self._sensors.cast(self._rows.batch, rows, positions, _rotations(c, s, upward))
        noise = self._noise.draw(rows)
        values = self._sensors.values(cast, self._touched[chosen], bases.angles_rad[chosen], noise)
        self._touched[chosen] = False
        poses = np.stack((x, y, _headings(c, s, upward)), axis=1)
        return BatchReadings(values[:, self._chosen], poses, failed, dict(self._rows.reasons))


def _pose(place: list[float]) -> tuple[float, float, float]:
    """Return the x, y and heading that a robot gets if a client writes this position and quaternion."""
    x, y, *quaternion = place
    rotation = from_axis_angle(quaternion_to_axis_angle(*quaternion))
    return x, y, Pose(rotation=rotation).heading_rad


def _rotations(c: Any, s: Any, upward: Any) -> Any:
    """Return the rotations about z (rows, 3, 3)."""
    found = np.zeros((len(c), 3, 3))
    found[:, 0, 0] = found[:, 1, 1] = c
    found[:, 0, 1], found[:, 1, 0] = -s, s
    found[:, 2, 2] = upward
    return found


def _headings(c: Any, s: Any, upward: Any) -> Any:
    """Return the headings that a client computes from the quaternions of these rotations."""
    trace = c + c + upward
    ahead = trace > 0.0
    root = 0.5 * np.sqrt(1.0 + np.where(ahead, trace, 0.0))
    back = np.sqrt(np.maximum(0.0, np.where(ahead, 1.0, 1.0 + upward - c - c)))
    z, w = (s + s) / (4.0 * root), root
    behind_w = (s + s) / (2.0 * back)
    behind_z = np.where(behind_w < 0.0, -1.0, 1.0) * (0.5 * back)
    z, w = np.where(ahead, z, behind_z), np.where(ahead, w, np.abs(behind_w))
    return within_half_turn(2.0 * arc_tangents(z, w))
