"""Many copies of a world that is a model of MuJoCo.

The motors of the request accept one quantity: `force` or `torque`, `velocity`, `position`, or `control`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any, Final

import numpy as np

from palaestra_protocol.batch import BatchDescription, BatchRequest
from palaestra_sim.mujoco.batched.rows import Rows
from palaestra_sim.mujoco.batched.world import BatchReadings, BatchRefusedError, Reset
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.generic_devices import MujocoActuator
from palaestra_sim.mujoco.mjcf.model import HINGE, SLIDE
from palaestra_sim.mujoco.mjcf.motors import ActuatorMotor, Control
from palaestra_sim.mujoco.mjcf.simulation import MjcfSimulation

_QUANTITIES: Final = {
    Control.FORCE: ("force", "torque"),
    Control.VELOCITY: ("velocity",),
    Control.POSITION: ("position",),
}
# The device of such a sensor limits the value. This class cannot limit values, so it refuses the sensor.
_CLIPPED: Final = int(mujoco.mjtSensor.mjSENS_RANGEFINDER)


class ModelBatch:
    """`count` copies of a model; see `BatchWorld`.

    Args:
        simulation: the simulation of one copy.
        name: the name of the model's file, in errors.
        count: the number of copies.
        threads: the number of threads; 0: one for each processor.
    """

    def __init__(self, simulation: MjcfSimulation, name: str, count: int, threads: int) -> None:
        self._simulation, self._name = simulation, name
        self._count, self._threads = count, threads

    def open(self, request: BatchRequest) -> BatchDescription:
        """Use the devices of the request from now on; see `BatchWorld`."""
        if lacks := list(self._lacks(request)):
            raise BatchRefusedError(self._name, lacks, "change the robot of the job, or the model")
        simulation, equipment = self._simulation, self._simulation.equipment
        simulation.reset()
        simulation.step(request.period_ms)
        model = simulation.model.model
        self._rows = Rows(model, simulation.model.data, self._count, self._threads)
        self._warm_start = self._rows.batch.bind("qacc_warmstart")
        self._steps = round(request.period_ms / 1000.0 / float(model.opt.timestep))
        self._controls = [equipment.numbers[name] for name in request.motors]
        self._read_limits(request)
        numbers = [equipment.numbers[name] for name in request.sensors]
        self._sensors = [int(model.sensor_adr[number]) for number in numbers]
        latest = max((int(model.sensor_needstage[number]) for number in numbers), default=0)
        self._stage = max(latest, int(mujoco.mjtStage.mjSTAGE_POS))
        joints = list(self._joints(request))
        self._positions = [int(model.jnt_qposadr[joint]) for joint in joints]
        self._speeds = [int(model.jnt_dofadr[joint]) for joint in joints]
        ranges = [model.jnt_range[it].tolist() if model.jnt_limited[it] else _ENDLESS for it in joints]
        self._stops = np.array(ranges, np.float64).reshape(len(joints), 2)
        return BatchDescription(
            rows=self._count, basic_step_ms=simulation.basic_step_ms, units=("",) * len(request.sensors)
        )

    def step(self, commands: Any) -> BatchReadings:
        """Simulate one period of all rows; see `BatchWorld`."""
        self._command(slice(None), commands)
        return self._period(None)

    def reset(self, reset: Reset) -> BatchReadings:
        """Reset rows and simulate one period of these rows; see `BatchWorld`."""
        rows = reset.rows
        self._rows.restart(rows)
        held = np.maximum(self._stops[:, 0], np.minimum(self._stops[:, 1], reset.joints))
        self._rows.qpos[rows[:, None], self._positions] = held
        self._rows.qvel[rows[:, None], self._speeds] = 0.0
        self._command(rows, reset.commands)
        return self._period(rows)

    def _command(self, rows: Any, commands: Any) -> None:
        """Set the controls of the motors for these commands; a command of NaN does not change a control."""
        held = self._scale * np.maximum(self._low, np.minimum(self._high, commands))
        for column, control in enumerate(self._controls):
            known = self._rows.ctrl[rows, control]
            self._rows.ctrl[rows, control] = np.where(np.isnan(held[:, column]), known, held[:, column])

    def _period(self, rows: Any) -> BatchReadings:
        chosen = slice(None) if rows is None else rows
        self._rows.step(rows, self._steps)
        failed = self._rows.failed(rows)
        # `forward` computes the sensors of the new state, and changes the solver's start values. They are
        # restored, so that the next step does not depend on `forward`.
        warm_start = self._warm_start[chosen].copy()
        self._rows.forward(rows, self._stage)
        self._warm_start[chosen] = warm_start
        values = self._rows.sensordata[chosen][:, self._sensors]
        return BatchReadings(values, np.zeros((len(values), 3)), failed, dict(self._rows.reasons))

    def _read_limits(self, request: BatchRequest) -> None:
        """Read, for each motor, the control that a command of 1 sets, and the limits of the commands."""
        rows = [_limits(device) for device in map(self._device, request.motors)]
        table = np.array(rows, np.float64).reshape(len(rows), 3)
        self._scale, self._low, self._high = table.T

    def _joints(self, request: BatchRequest) -> Iterator[int]:
        """Yield the numbers of the joints of a request; skip the names of unknown joints."""
        for name in request.joints:
            node = self._simulation.tree.of_def(name)
            if node is not None and node in self._simulation.nodes.joints:
                yield self._simulation.nodes.joints[node]

    def _device(self, name: str) -> object | None:
        return self._simulation.robots[0].device(name)

    def _lacks(self, request: BatchRequest) -> Iterator[str]:
        simulation = self._simulation
        model, numbers = simulation.model.model, simulation.equipment.numbers
        if request.period_ms % simulation.basic_step_ms:
            step_ms = simulation.basic_step_ms
            yield f"{request.period_ms} ms is not a multiple of the basic step of {step_ms} ms"
        for name in request.motors:
            if fact := _lack_of_motor(self._device(name), request.commanded):
                yield f"the motor {name!r} {fact}"
        for name in request.sensors:
            number = numbers.get(name)
            if number is None or isinstance(self._device(name), (ActuatorMotor, MujocoActuator)):
                yield f"the model has no sensor {name!r}"
            elif model.sensor_dim[number] != 1 or model.sensor_type[number] == _CLIPPED:
                yield f"does not read {name!r}, which measures several numbers or a distance"
        for name in request.joints:
            node = simulation.tree.of_def(name)
            joint = None if node is None else simulation.nodes.joints.get(node)
            if joint is None or model.jnt_type[joint] not in {HINGE, SLIDE}:
                yield f"the model has no hinge or slider {name!r}"
        if request.robot or request.mark:
            yield f"does not place {request.robot or request.mark} in a model of MuJoCo"


_ENDLESS: Final = (-math.inf, math.inf)


def _lack_of_motor(device: object, commanded: str) -> str:
    """Return the reason why a device refuses this kind of command; "" if the device accepts it."""
    if isinstance(device, MujocoActuator):
        return "" if commanded == "control" else "is commanded by control"
    if not isinstance(device, ActuatorMotor):
        return "does not exist"
    wanted = _QUANTITIES[device.control[0]]
    return "" if commanded in wanted else f"is commanded by {wanted[0]}, not by {commanded}"


def _limits(device: object) -> tuple[float, float, float]:
    """Return the control for a command of 1, and the least and greatest command, as in `ActuatorMotor`."""
    if isinstance(device, MujocoActuator):
        return 1.0, device.low, device.high
    if not isinstance(device, ActuatorMotor):
        raise TypeError("not a motor")  # `_lack_of_motor` excludes this
    control, scale = device.control
    spec = device.spec
    if control is Control.POSITION:
        limited = spec.min_rad != spec.max_rad
        return scale, *((spec.min_rad, spec.max_rad) if limited else _ENDLESS)
    most = abs(spec.max_torque_nm) if control is Control.FORCE else spec.max_velocity_rad_s
    return scale, -most, most
