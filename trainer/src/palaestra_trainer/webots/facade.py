"""Webots, started on demand: the paper's facade.

Time passes inside of `with webots:` and of `webots.run(...)`, and stands everywhere else, whichever program
simulates: between steps a simulator that is not paused takes a whole core for nothing.
"""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from types import TracebackType
from typing import Protocol, Self, TypeVar

from palaestra_trainer.errors import SimulatorDead, SimulatorFault, SimulatorHung, TrainerError
from palaestra_trainer.ros import RosService
from palaestra_trainer.webots.observer import Mode, Observer
from palaestra_trainer.webots.supervisor import Supervisor

Result = TypeVar("Result")

_PROBE_S = 1.0
_POLL_S = 0.02
_STOP_DEADLINE_S = 5.0  # the longest time it may take to quit by itself


class Launcher(Protocol):
    """What starts the simulator's process, and knows whether it runs."""

    def start(self) -> None:
        """Begin to start it; return before it is ready."""
        ...

    def confirm_ready(self) -> None:
        """Tell that it has answered a real round trip."""
        ...

    def ready(self) -> bool:
        """Return whether it runs, and was confirmed to be ready."""
        ...

    def expect_stop(self, deadline_s: float) -> None:
        """Announce that it will end; it is killed once `deadline_s` seconds have passed."""
        ...

    def failure(self) -> str | None:
        """Return why it is not running any more, None while it runs or starts."""
        ...

    def wait_stopped(self, deadline_s: float) -> None:
        """Return when its process has ended.

        Raises:
            SimulatorHung: it has not within `deadline_s` seconds.
        """
        ...


class Owned(Launcher, Protocol):
    """A launcher that lives for one facade."""

    def close(self) -> None:
        """End what it started."""
        ...


class Webots:
    """One simulator, started, stopped and switched between fast and pause.

    By default it is a simulator of its own: where the ROS names of the world are in use on the master, `_2`,
    `_3`, ... stands behind them. One that runs already is used with `launcher=Attached()` only.

    Args:
        supervisor_node_name: the ROS name that the world gives its supervisor.
        world_path: the world to load; or the name of a world that ships, e.g. "arena".
        launcher: what starts the process; by default a process on this machine.
        driver: of that process: "stub", the simulator that ships, or "webots".
        options: command-line options of that process, e.g. ["--step-sleep-ms=5"].
        start_deadline_s: the longest time until it answers.

    Raises:
        ConfigurationError: the process on this machine refused the world or the driver.
    """

    def __init__(
        self,
        supervisor_node_name: str,
        world_path: str | Path,
        *,
        launcher: Launcher | None = None,
        driver: str = "stub",
        options: Sequence[str] = (),
        start_deadline_s: float = 60.0,
    ) -> None:
        self._own: Owned | None = None
        self._suffix = ""
        if launcher is None:
            # The launcher talks to a sidecar, which this layer knows nothing of.
            from palaestra_trainer.simulators.process import ProcessLauncher  # noqa: PLC0415

            own = ProcessLauncher.beside_others(world_path, driver, options)
            launcher = self._own = own
            self._suffix = own.suffix
        supervisor_node_name = self.name_of(supervisor_node_name)
        self.supervisor_node_name = supervisor_node_name
        self.world_path = world_path
        self.observer = Observer(supervisor_node_name)
        self.supervisor = Supervisor(supervisor_node_name, self.observer)
        self._launcher = launcher
        # Its own connection, with a shorter patience: a simulator that hangs is not available.
        self._probe = RosService(f"/{supervisor_node_name}/robot/get_time", "webots_ros/get_float", _PROBE_S)
        self._start_deadline_s = start_deadline_s
        self._at_start: dict[str, Callable[[], None]] = {}
        self._entered = 0
        self._stopped = False

    @property
    def robot_name(self) -> str:
        """The ROS name of the supervisor as it runs: the one that was given, perhaps with `_2` behind it."""
        return self.supervisor_node_name

    def name_of(self, robot: str) -> str:
        """Return the ROS name, as it runs, of the robot that the world gives the ROS name `robot`."""
        return f"{robot}{self._suffix}"

    def at_start(self, name: str, connect: Callable[[], None]) -> None:
        """Have `connect` called after each start from now on, in place of what `name` had called before."""
        self._at_start[name] = connect

    def start(self) -> None:
        """Start the simulator and return when it answers and its robots are connected.

        One that runs is connected to anew, one that hangs is restarted. Time stands then, except inside of
        `with webots:`.

        Raises:
            SimulatorDead: its process ended.
            SimulatorHung: it did not answer in time.
            WrongData: it refuses to be paused, or a robot what it wants of its devices.
        """
        if self._launcher.ready() and not self.available():
            self.stop()  # it hangs, and as long as it is there no other can be started
        self._disconnect()
        self._launcher.start()
        self.wait_available()
        self._launcher.confirm_ready()
        self._stopped = False
        self.supervisor.set_mode(Mode.FAST if self._entered else Mode.PAUSE)
        for connect in self._at_start.values():
            connect()

    def wait_available(self) -> None:
        """Return when the simulator answers, after a start or a reload.

        Raises:
            SimulatorDead: its process ended.
            SimulatorHung: it did not answer in time.
        """
        give_up = time.monotonic() + self._start_deadline_s
        while not self.available():
            failure = self._launcher.failure()
            if failure is not None:
                raise SimulatorDead(self.supervisor_node_name, failure)
            if time.monotonic() > give_up:
                raise SimulatorHung(
                    self.supervisor_node_name, f"did not start within {self._start_deadline_s:g} s"
                )
            time.sleep(_POLL_S)  # between two real round trips; the master has no call that waits

    def stop(self) -> None:
        """Let the simulator quit through its supervisor; it is killed only when it does not.

        Raises:
            SimulatorHung: even killing it had no effect in time.
        """
        self._stopped = True
        try:
            self._end()
        finally:
            self._disconnect()
        self._launcher.wait_stopped(_STOP_DEADLINE_S + _PROBE_S)

    def __call__(self) -> None:
        """Restart the simulator, however it is; afterwards all is as after `start`.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: as `stop` and `start`.
        """
        self.stop()
        self.start()

    def available(self) -> bool:
        """Return whether the simulator answers a real round trip now."""
        try:
            self._probe(ask=True)
        except SimulatorFault:
            return False
        return True

    def run(self, callback: Callable[[], Result], restart: bool = False) -> Result:  # noqa: FBT001, FBT002 - the paper's signature
        """Return what `callback` returns, called while the simulation runs as fast as possible.

        Args:
            callback: what needs the simulation.
            restart: whether the simulator is started anew before.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: it cannot be started, run or paused.
            Any error of `callback`, which hides that it cannot be paused.
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
            return  # the block around this one goes on, or there is nothing left to be paused
        try:
            self.supervisor.set_mode(Mode.PAUSE)
        except TrainerError:
            # What went wrong inside is the news, not that the simulator is gone now.
            if exc is None:
                raise

    def close(self) -> None:
        """Drop all connections, and end the process if it was started for this facade alone.

        Raises:
            subprocess.TimeoutExpired: that process does not end; no other error, whatever the simulator does.
        """
        self._disconnect()
        if self._own is not None:
            self._own.close()

    def _end(self) -> None:
        if not self.available():
            self._launcher.expect_stop(0.0)
            return
        self._launcher.expect_stop(_STOP_DEADLINE_S)
        # It may break before it quits; the announced deadline ends it then.
        with contextlib.suppress(SimulatorFault):
            self.supervisor.quit()

    def _disconnect(self) -> None:
        self._probe.close()
        self.observer.close()
        self.supervisor.close()
