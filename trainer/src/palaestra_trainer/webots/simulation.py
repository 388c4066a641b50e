"""Step a simulation; only this module calls `time_step`.

One step lasts one period for all robots of the world, and in this period every sensor sends one message. The
controller can miss its own wake-up, and then sends no messages for that step. So the wait for a message is
limited. After this wait, the simulation steps once more. An extra step is not a fault, but it is counted.

While the simulation is paused, no step is requested. The controller would wait for simulated time to pass,
and could not receive the request that ends the pause.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Protocol

from palaestra_trainer.errors import Paused, SimulatorFault, SimulatorHung, WrongData
from palaestra_trainer.ros import RosService, call_together
from palaestra_trainer.waiting.greenlets import away_s, let_others
from palaestra_trainer.waiting.wait_time import waited_s
from palaestra_trainer.webots.device_check import require_devices, require_node
from palaestra_trainer.webots.devices import Sensor
from palaestra_trainer.webots.observer import Observer
from palaestra_trainer.webots.supervisor import Supervisor

# Two extra steps deliver the messages of a lost wake-up. A sensor that is still silent afterwards has a
# fault.
_MOST_EXTRA_STEPS = 2


class Actuator(Protocol):
    """The interface of a motor that `Stepper` uses."""

    @property
    def robot(self) -> str:
        """The ROS name of the robot's controller."""
        ...

    @property
    def device(self) -> str:
        """The name of the motor in the world."""
        ...

    def release(self) -> None:
        """Withdraw all commands; this is needed at the start and after every reset."""
        ...

    def close(self) -> None:
        """Close the connections."""
        ...


class Stepper:
    """Steps and resets the simulation.

    Args:
        robots: the ROS names of all robots of the world; Webots steps only after all of them have requested a
            step.
        supervisor: the supervisor, which resets the simulation and places nodes.
        observer: the observer, which reads the tracked poses.
        period_ms: simulated milliseconds per step, a multiple of the world's basicTimeStep.

    Attributes:
        simulated_s: seconds of simulated time since this object was created.
        transport_s: seconds that this program spent in complete steps, without the waits for the simulator.
    """

    def __init__(
        self, robots: Sequence[str], supervisor: Supervisor, observer: Observer, period_ms: int
    ) -> None:
        self.period_ms = period_ms
        self.simulated_s = self.transport_s = 0.0
        self._observer = observer
        self._supervisor = supervisor
        self._steps = [RosService(f"/{robot}/robot/time_step", "webots_ros/set_int") for robot in robots]
        self._sensors: list[Sensor] = []
        self._motors: list[Actuator] = []
        self._tracked: dict[str, tuple[float, float, float] | None] = {}
        self._connected = False

    def add(self, sensors: Sequence[Sensor], motors: Sequence[Actuator]) -> None:
        """Add a robot's devices; each step reads the sensors, and each reset releases the motors."""
        self._sensors += sensors
        self._motors += motors

    def use(self, sensor: Sensor) -> None:
        """Add a sensor unless it is already known; if the simulator is connected, enable the sensor.

        Raises:
            WorldMisfit: the robot lacks the sensor, or the sensor cannot be enabled; the sensor is then not
                added.
            SimulatorDead, SimulatorHung, WrongData
        """
        if sensor in self._sensors:
            return
        if self._connected:
            try:
                require_devices(sensor.robot, [sensor.device] if sensor.listed else [])
                self._enable(sensor)
            except SimulatorFault:
                sensor.close()
                raise
        self._sensors.append(sensor)

    def use_motor(self, motor: Actuator) -> None:
        """Add a motor unless it is already known; if the simulator is connected, release the motor.

        Raises:
            WorldMisfit: the robot lacks the motor, which is then not added.
            SimulatorDead, SimulatorHung, WrongData
        """
        if motor in self._motors:
            return
        if self._connected:
            try:
                require_devices(motor.robot, [motor.device])
                motor.release()
            except SimulatorFault:
                motor.close()
                raise
        self._motors.append(motor)

    def track(self, name: str) -> None:
        """Make each step read the pose of the node with DEF `name`, which `pose` then returns."""
        self._tracked[name] = None

    def pose(self, name: str) -> tuple[float, float, float]:
        """Return x, y (meters) and heading (radians) of a tracked node after the last step.

        Raises:
            KeyError: the node is not tracked.
            SimulatorDead, SimulatorHung, WrongData: no step has been taken yet, and the request for the pose
                failed.
        """
        return self._tracked[name] or self._observer.pose(name)

    def known_pose(self, name: str) -> tuple[float, float, float] | None:
        """Return the pose of a tracked node after the last step, without a request; None before any step."""
        return self._tracked.get(name)

    def connect(self) -> None:
        """Enable every sensor and release every motor; call this method after a start of the simulator.

        Raises:
            WorldMisfit: the world lacks a device or a tracked node.
            SimulatorDead, SimulatorHung, WrongData
        """
        self._require_all()
        self._tracked = dict.fromkeys(self._tracked)
        for sensor in self._sensors:
            self._enable(sensor)
        self._release_motors()
        self._connected = True

    def step(self) -> int:
        """Simulate one period and read every sensor; return the number of extra steps, normally 0.

        Raises:
            Paused: the simulation is paused; no request was sent.
            SimulatorDead, SimulatorHung: also if a sensor does not send a message.
            WrongData: the simulator refused the period, or a reading is invalid.
        """
        if self._supervisor.paused:
            raise self._paused()
        began_s = _busy_s()
        silent = self._advance_and_read()
        extra_steps = 0
        while silent is not None:
            if extra_steps == _MOST_EXTRA_STEPS:
                raise SimulatorHung(self._supervisor.node_name, f"{silent.device} sends no message")
            extra_steps += 1
            silent = self._advance_and_read()
        self.transport_s += _busy_s() - began_s
        return extra_steps

    def reset(self, seed: int) -> None:
        """Reset the simulation with a seed; afterwards the scene places its nodes.

        Raises:
            Paused: the simulation is paused; no request was sent.
            SimulatorDead, SimulatorHung, WrongData
        """
        if self._supervisor.paused:
            raise self._paused()
        self._supervisor.set_seed(seed)
        self._supervisor.reset()
        self.step()
        self._release_motors()

    def close(self) -> None:
        """Close all connections of steps, sensors and motors."""
        self._connected = False
        parts: tuple[RosService | Sensor | Actuator, ...] = (*self._steps, *self._sensors, *self._motors)
        for part in parts:
            part.close()

    def _enable(self, sensor: Sensor) -> None:
        try:
            sensor.enable(self.period_ms)
        except SimulatorFault as fault:
            raise sensor.explained(fault) from fault

    def _require_all(self) -> None:
        wanted: dict[str, list[str]] = {}
        listed = [sensor for sensor in self._sensors if sensor.listed]
        parts: tuple[Sensor | Actuator, ...] = (*listed, *self._motors)
        for part in parts:
            wanted.setdefault(part.robot, []).append(part.device)
        for robot, devices in wanted.items():
            require_devices(robot, devices)
        for name in self._tracked:
            require_node(self._observer, name)

    def _advance_and_read(self) -> Sensor | None:
        for sensor in self._sensors:
            if sensor.late:
                sensor.read_arrived()
        try:
            self._advance()
            # Poses are requested before the sensors are read, so responses and messages arrive during the
            # turns of other simulators. A controller responds after it has sent the messages of its sensors.
            asked = None
            for name in self._tracked:
                asked = self._observer.begin_pose(name)
            let_others(until=asked)
            silent = self._read_sensors()
            for name in self._tracked:
                self._tracked[name] = self._observer.finish_pose(name)
        except BaseException:  # also Ctrl-C, because messages of this step may arrive later
            for sensor in self._sensors:
                sensor.late = True
            raise
        return silent

    def _read_sensors(self) -> Sensor | None:
        """Read every sensor once; return the first sensor without a message, or None."""
        silent = None
        for sensor in self._sensors:
            # A lost wake-up affects all sensors, so this method waits only for the first silent sensor.
            spoke = sensor.read() if silent is None else sensor.read_arrived()
            if not spoke:
                silent = silent or sensor
        return silent

    def _advance(self) -> None:
        wanted = [(step, {"value": self.period_ms}) for step in self._steps]
        answers = call_together(wanted, meanwhile=let_others)
        if not all(answer.success for answer in answers):
            raise WrongData(
                self._supervisor.node_name,
                f"refused a step of {self.period_ms} ms; use a multiple of the world's basicTimeStep",
            )
        self.simulated_s += self.period_ms / 1000.0

    def _paused(self) -> Paused:
        return Paused(f"{self._supervisor.node_name} is paused; step inside `with webots:`")

    def _release_motors(self) -> None:
        for motor in self._motors:
            motor.release()


def _busy_s() -> float:
    """Return the time on a clock that runs only while this thread works for this simulator."""
    return time.perf_counter() - away_s() - waited_s()
