"""The facade `Webots`, which starts a simulator on demand; CITATION.cff cites the paper that describes it.

Simulated time passes only inside `with webots:` and `webots.run(...)`. Outside of these blocks and calls,
every simulator is paused, because a running simulator uses a whole core even between steps.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Self, TypeVar

from palaestra_trainer.errors import (
    SimulatorDead,
    SimulatorFault,
    SimulatorHung,
    SimulatorRefused,
    TrainerError,
)
from palaestra_trainer.ros import RosService
from palaestra_trainer.webots.attached import Attached
from palaestra_trainer.webots.facade_registry import FacadeRegistry
from palaestra_trainer.webots.launcher_names import LauncherName, launcher_named
from palaestra_trainer.webots.launching.launcher import Launcher, Place
from palaestra_trainer.webots.launching.owned_sidecar import OwnedSidecar
from palaestra_trainer.webots.launching.side_by_side import launch_beside_others
from palaestra_trainer.webots.launching.simulator_request import SimulatorRequest
from palaestra_trainer.webots.observer import Mode, Observer
from palaestra_trainer.webots.supervisor import Supervisor

Result = TypeVar("Result")

_PROBE_S = 1.0
_POLL_S = 0.02
_STOP_DEADLINE_S = 5.0  # the longest time that a simulator may take to quit
_ENDS_S = 5.0  # the longest time that controllers may take to end; Webots terminates them after one second
_CONTROLLERS_S = 20.0  # the longest time from the supervisor's first response until all robots respond


class Webots:
    """A simulator that a program can start, stop, run fast and pause.

    By default the simulator is new, and runs on this machine. If the ROS names of the world are already in
    use on the master, `_2`, `_3`, ... is appended to the names.

    The next environment that is created without a simulator uses this simulator.

    Args:
        supervisor_node_name: the ROS name of the supervisor in the world.
        world_path: path of the world to load, or the name of a shipped world, e.g. "arena".
        launcher: the place in which a new simulator starts, by its name or with settings: "process" or
            `ThisMachine()`, "docker" or `Docker(...)`, "kubernetes" or `Kubernetes(...)`. For a simulator
            that already runs: "attach" or `Attached()`. Any other `Launcher` is accepted too.
        driver: the simulator program: "stub", "mujoco" or "webots".
        options: command-line options of the simulator program, e.g. ["--step-sleep-ms=5"].
        start_deadline_s: the longest time from the start until the simulator responds.

    Raises:
        ConfigurationError: the place cannot start a simulator, or the world or the driver was refused; the
            message has the remedy.
    """

    def __init__(
        self,
        supervisor_node_name: str,
        world_path: str | Path,
        *,
        launcher: LauncherName | Place | Launcher = "process",
        driver: str = "stub",
        options: Sequence[str] = (),
        start_deadline_s: float = 60.0,
    ) -> None:
        self._own: OwnedSidecar | None = None
        self._suffix = ""
        chosen = launcher_named(launcher) if isinstance(launcher, str) else launcher
        if isinstance(chosen, Place):
            request = SimulatorRequest(world=world_path, driver=driver, options=options)
            chosen = self._own = launch_beside_others(chosen, request)
            self._suffix = self._own.suffix
        supervisor_node_name = self.name_of(supervisor_node_name)
        self.supervisor_node_name = supervisor_node_name
        self.world_path = world_path
        self.observer = Observer(supervisor_node_name)
        self.supervisor = Supervisor(supervisor_node_name, self.observer)
        self._launcher = chosen
        # The probe has its own connection with a shorter deadline, because it must detect a hang early.
        self._probe = RosService(*_time_of(supervisor_node_name), _PROBE_S)
        self._start_deadline_s = start_deadline_s
        # For each `name` of `at_start`: the function, and the robots that must respond before its call.
        self._at_start: dict[str, tuple[Callable[[], None], tuple[str, ...]]] = {}
        self._entered = 0
        self._stopped = False
        open_facades.offer(self)

    @property
    def robot_name(self) -> str:
        """The ROS name of the running supervisor: the given name, possibly with `_2` appended."""
        return self.supervisor_node_name

    def name_of(self, robot: str) -> str:
        """Return the ROS name of a running robot; `robot` is its ROS name in the world."""
        return f"{robot}{self._suffix}"

    def at_start(self, name: str, connect: Callable[[], None], robots: Iterable[str] = ()) -> None:
        """Call `connect` after each later start, instead of a previous function with this `name`.

        The controllers of `robots`, which are the ROS names of running robots, respond before the call.
        """
        self._at_start[name] = (connect, tuple(robots))

    def start(self) -> None:
        """Start the simulator and wait until it responds and its robots are connected.

        If the simulator already runs, its connections are opened again. If it hangs, it is restarted. Outside
        `with webots:`, the simulator is paused afterwards.

        Raises:
            SimulatorDead: the process of the simulator ended.
            SimulatorHung: it did not respond in time.
            WrongData: the simulator refuses to pause, or refuses the devices of a robot.
        """
        if self._launcher.ready() and not self.available():
            self.stop()  # the simulator hangs, and must end before another can start
        self._disconnect()
        self._launcher.start()
        self.wait_available()
        self._launcher.confirm_ready()
        self._stopped = False
        self.supervisor.set_mode(Mode.FAST if self._entered else Mode.PAUSE)
        for connect, _ in self._at_start.values():
            connect()

    def reload(self) -> None:
        """Load the world again, and wait until its new controllers respond.

        All connections of devices must be opened again.
        In Webots, the old controllers still respond for a moment. So this method waits until they have closed
        their connections, before it connects to the new ones.

        Raises:
            SimulatorDead, SimulatorHung: as `wait_available`.
            WrongData: a controller failed.
        """
        with contextlib.ExitStack() as connections:
            old = [RosService(*_time_of(robot)) for robot in self._controlled()]
            for clock in old:
                connections.callback(clock.close)
                clock(ask=True)
            self.supervisor.reload()
            give_up = time.monotonic() + _ENDS_S
            for clock in old:
                clock.await_end(give_up - time.monotonic())
        self._disconnect()
        # `Attached` has no process to check, and its simulator has no ROS names during a reload.
        self._await_supervisor(watched=not isinstance(self._launcher, Attached))
        self._await_controllers()

    def wait_available(self) -> None:
        """Wait until the simulator and the controllers of its robots respond, after a start or a reload.

        Raises:
            SimulatorDead: the simulator's process ended, or a robot has no controller; SimulatorRefused, a
                subclass, if the simulator refused its input.
            SimulatorHung: it did not respond in time.
        """
        self._await_supervisor(watched=True)
        self._await_controllers()

    def stop(self) -> None:
        """End the simulator through its supervisor; kill it only if it does not quit.

        Raises:
            SimulatorHung: the simulator did not quit, and the kill did not end it in time.
        """
        self._stopped = True
        try:
            self._end()
        finally:
            self._disconnect()
        self._launcher.wait_stopped(_STOP_DEADLINE_S + _PROBE_S)

    def __call__(self) -> None:
        """Restart the simulator in any state; afterwards its state is the same as after `start`.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `stop` and `start`.
        """
        self.stop()
        self.start()

    def available(self) -> bool:
        """Return whether the simulator responds to a real request now."""
        try:
            self._probe(ask=True)
        except SimulatorFault:
            return False
        return True

    def run(self, callback: Callable[[], Result], restart: bool = False) -> Result:  # noqa: FBT001, FBT002 - the paper's signature
        """Call `callback` while the simulation runs as fast as possible; return its result.

        Args:
            callback: the function that needs the simulation.
            restart: whether to restart the simulator first.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the simulator cannot be started, run or paused.
            Any error of `callback`, even if the pause after it fails too.
        """
        if restart:
            self()
        with self:
            return callback()

    def __enter__(self) -> Self:
        if not self.available():
            self.start()
        self._stopped = False
        self.supervisor.set_mode(Mode.FAST)
        self._entered += 1
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        self._entered -= 1
        if self._entered or self._stopped:
            return  # an enclosing block continues, or the simulator has stopped
        try:
            self.supervisor.set_mode(Mode.PAUSE)
        except TrainerError:
            # If the block raised an error, that error is more important than the failed pause.
            if exc is None:
                raise

    def close(self) -> None:
        """Close all connections; end the simulator's process if this facade started it.

        Raises:
            subprocess.TimeoutExpired: the process does not end. Errors of the simulator are suppressed.
        """
        open_facades.withdraw(self)
        self._disconnect()
        if self._own is not None:
            self._own.close()

    def _controlled(self) -> tuple[str, ...]:
        """Return the ROS names of the supervisor and of the robots that are connected at a start."""
        robots = (robot for _, group in self._at_start.values() for robot in group)
        return tuple(dict.fromkeys((self.supervisor_node_name, *robots)))

    def _await_supervisor(self, *, watched: bool) -> None:
        """Wait until the simulator responds; if not `watched`, check its process only at the deadline."""
        give_up = time.monotonic() + self._start_deadline_s
        while not self.available():
            late = time.monotonic() > give_up
            if watched or late:
                self._check_process()
            if late:
                raise SimulatorHung(
                    self.supervisor_node_name, f"did not start within {self._start_deadline_s:g} s"
                )
            time.sleep(_POLL_S)  # the master has no call that waits for a node

    def _await_controllers(self) -> None:
        give_up = time.monotonic() + _CONTROLLERS_S
        for robot in self._controlled():
            self._await_controller(robot, give_up)

    def _await_controller(self, robot: str, give_up: float) -> None:
        """Wait until a robot returns its devices, whose service a controller registers last.

        In Webots, each robot has a controller process of its own, which may start after the supervisor's.
        """
        while True:
            observer = Observer(robot)
            try:
                observer.devices()
            except SimulatorDead:
                if not self.available():
                    self._check_process()
                if time.monotonic() > give_up:
                    raise
            else:
                return
            finally:
                observer.close()
            time.sleep(_POLL_S)

    def _check_process(self) -> None:
        failure = self._launcher.failure()
        if failure is not None:
            kind = SimulatorRefused if self._launcher.refused() else SimulatorDead
            raise kind(self.supervisor_node_name, failure)

    def _end(self) -> None:
        if not self.available():
            self._launcher.expect_stop(0.0)
            return
        self._launcher.expect_stop(_STOP_DEADLINE_S)
        # If the simulator fails before it quits, the launcher kills it at the announced deadline.
        with contextlib.suppress(SimulatorFault):
            self.supervisor.quit()

    def _disconnect(self) -> None:
        self._probe.close()
        self.observer.close()
        self.supervisor.close()


def _time_of(robot: str) -> tuple[str, str]:
    """Return name and type of the service with the simulated time, which every controller has."""
    return f"/{robot}/robot/get_time", "webots_ros/get_float"


open_facades: FacadeRegistry[Webots] = FacadeRegistry()
