"""A simulator with many copies of its world, behind a sidecar; a member of a run."""

from __future__ import annotations

import contextlib
import threading
import time
from typing import Any, Final, Never

import gymnasium
from gymnasium import spaces

from palaestra_trainer.environments.batched import BatchedEnv
from palaestra_trainer.environments.make import make_batched
from palaestra_trainer.errors import SimulatorDead, SimulatorFault, SimulatorHung, SimulatorRefused
from palaestra_trainer.job.configuration import DEFAULT_ROBOT, Configuration
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.robots.batch_link import BatchLink
from palaestra_trainer.robots.batched import BatchedScene, batched_form
from palaestra_trainer.simulators.robot_registry import robot_class
from palaestra_trainer.webots.launching.sidecar import Sidecar

_POLL_S: Final = 0.05
STOP_S: Final = 2.0  # the simulator ends at SIGKILL, which the sidecar sends after this time


class BatchSimulator:
    """A simulator with many copies of its world; see `Member`.

    Args:
        sidecar: the sidecar, which starts and stops the simulator.
        configuration: defines the environment and its robot.
        entry: the settings of this simulator.

    Attributes:
        name: `<group>-<index>`, as in the configuration.
        batched: the environment of all copies.
        env: the spaces and attributes of one copy, for code that asks an environment for them.

    Raises:
        ConfigurationError: the environment or the robot has no batched form.
    """

    def __init__(self, sidecar: Sidecar, configuration: Configuration, entry: SimulatorConfiguration) -> None:
        self.name = entry.name
        self.sidecar = sidecar
        kind = robot_class(configuration.robot or DEFAULT_ROBOT)
        rows = entry.batch or 1
        self._deadline_s = entry.start_deadline_seconds
        self._robot = batched_form(kind)(kind, BatchLink(entry.name), rows)
        self._scene = BatchedScene(self._robot)
        self.batched: BatchedEnv = make_batched(configuration.environment, self._robot, self._scene)
        self.env = OneOfMany(self.batched)
        self._abandoned = threading.Event()

    @property
    def failed(self) -> Any:
        """For each row, whether its copy failed in the last step or reset."""
        return self._robot.failed

    def reason(self, row: int) -> str:
        """Return the reason why a row failed."""
        return self._robot.reasons.get(row, "its simulation failed")

    @property
    def simulated_s(self) -> float:
        """Seconds of simulated time of all copies together, over all restarts."""
        return self._robot.simulated_s

    def left_out(self) -> tuple[str, ...]:
        """Return the parts of its world that the simulator left out at its last start, as lines of text."""
        return self.sidecar.left_out

    def due(self, episodes: int = 1) -> None:
        """Return None: the copies never end their episodes together, so the simulator is not recycled."""
        del episodes

    def start(self) -> None:
        """Start the simulator and connect to it.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the simulator does not start in time.
        """
        self._abandoned.clear()
        give_up = time.monotonic() + self._deadline_s
        self.sidecar.first_state(self._deadline_s)
        self.sidecar.start()
        self._scene.connect(self._address(give_up))
        self.sidecar.confirm_ready()

    def stop(self) -> None:
        """Stop the simulator, in any state."""
        self._robot.close()
        self.sidecar.expect_stop(0.0)
        self.sidecar.wait_stopped(STOP_S)

    def restart(self) -> None:
        """Stop the simulator, in any state, and start it.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the simulator or its sidecar does not start in time.
        """
        self.sidecar.first_state(self._deadline_s)
        self.stop()
        self.start()

    def abandon(self) -> None:
        """Make a start or restart in another thread fail soon."""
        self._abandoned.set()
        with contextlib.suppress(SimulatorFault):
            self.sidecar.expect_stop(0.0)

    def pause(self) -> None:
        """Do nothing: the simulator uses no processor time between two requests."""

    def unpause(self) -> None:
        """Do nothing; see `pause`."""

    def _address(self, give_up: float) -> str:
        """Return the address of the copies, as soon as the simulator serves them."""
        while True:
            state = self.sidecar.state()
            if state.batch:
                return state.batch
            if failure := self.sidecar.failure():
                refused = SimulatorRefused if self.sidecar.refused() else SimulatorDead
                raise refused(self.name, failure)
            if time.monotonic() > give_up:
                raise SimulatorHung(self.name, f"does not serve its copies within {self._deadline_s:g} s")
            if self._abandoned.wait(_POLL_S):
                raise SimulatorDead(self.name, "its start was canceled")


class OneOfMany(gymnasium.Env[Any, Any]):
    """An environment with the spaces and attributes of one copy of a batched environment; it cannot step.

    Attributes that a program sets are set on the batched environment.

    Args:
        batched: the environment of all copies.
    """

    def __init__(self, batched: BatchedEnv) -> None:
        self.batched = batched
        self.observation_space: spaces.Space[Any] = batched.single_observation_space
        self.action_space: spaces.Space[Any] = batched.single_action_space

    def has_wrapper_attr(self, name: str) -> bool:
        """Return whether the batched environment has an attribute."""
        return hasattr(self.batched, name)

    def get_wrapper_attr(self, name: str) -> Any:
        """Return an attribute of the batched environment."""
        return getattr(self.batched, name)

    def set_wrapper_attr(self, name: str, value: Any, *, force: bool = True) -> bool:
        """Set an attribute of the batched environment; return whether it was set.

        Without `force`, only an existing attribute is set.
        """
        if not (force or hasattr(self.batched, name)):
            return False
        setattr(self.batched, name, value)
        return True

    def step(self, action: Any) -> Never:
        """Raise an error: the copies step together."""
        raise NotImplementedError(f"{type(self.batched).__name__} steps all copies together")

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> Never:
        """Raise an error: see `step`."""
        del seed, options
        raise NotImplementedError(f"{type(self.batched).__name__} resets its copies itself")

    def close(self) -> None:
        """Close the batched environment."""
        self.batched.close()
