"""A member with a spare: a second simulator that takes over when the first must be restarted.

Both simulators belong to one sidecar and differ in their ROS names. A restart swaps their roles: the spare
takes over at once if it is ready. The other simulator is restarted in its own thread and becomes the spare.
If this restart fails, it is repeated, within a budget like that of the active simulator. When that budget is
spent, the spare stays down.

If the spare fails while it stands by, its fault is detected and reported when it must take over. The restart
after that fault waits for the other simulator, which is already starting. So a restart never waits for more
than one start.

Each simulator has its own environment, so read `env` again after a restart.
"""

from __future__ import annotations

import contextlib
from concurrent.futures import Future, wait

import structlog

from palaestra_protocol.pod.status import StandbyState
from palaestra_protocol.scene import SceneState, VisibleScene
from palaestra_trainer.errors import (
    FaultBudgetSpent,
    SimulatorDead,
    SimulatorFault,
    SimulatorHung,
    WorldMisfit,
)
from palaestra_trainer.robots.sight import Sight
from palaestra_trainer.simulators.budget import RestartBudget, RestartLimit
from palaestra_trainer.simulators.interface import Environment
from palaestra_trainer.simulators.simulator import Simulator
from palaestra_trainer.simulators.threads import in_background

log = structlog.get_logger(__name__)

_ASK_AGAIN_S = 0.05


class Standby:
    """Two simulators as one member.

    Args:
        first: the simulator that is active at the beginning.
        second: the simulator that is the spare at the beginning.
        limit: limit for repeated starts of a spare that does not start.
    """

    def __init__(self, first: Simulator, second: Simulator, limit: RestartLimit | None = None) -> None:
        self._active, self._spare = (
            Side(simulator, limit or RestartLimit()) for simulator in (first, second)
        )
        self._both = (first, second)

    @property
    def name(self) -> str:
        """`<group>-<index>`, as in the configuration."""
        return self._active.simulator.name

    @property
    def env(self) -> Environment:
        """The environment of the active simulator; after a restart it is another object."""
        return self._active.simulator.env

    @property
    def resets(self) -> int:
        """The number of resets since the active simulator was last started."""
        return self._active.simulator.resets

    @property
    def simulated_s(self) -> float:
        """The sum of both simulators' simulated seconds since their creation, over all restarts."""
        return sum(each.simulated_s for each in self._both)

    def spare(self) -> StandbyState | None:
        """Return the state of the spare; None if the spare is neither ready nor starting."""
        return self._spare.state

    def left_out(self) -> tuple[str, ...]:
        """Return the parts that the first simulator left out; the second has the same world."""
        return self._both[0].left_out()

    def sight(self) -> Sight | None:
        """Return the positions of robot and target in the active simulator; None without a floor."""
        return self._active.simulator.sight()

    def visible_scene(self) -> VisibleScene | None:
        """Return the visible shapes of the active simulator's world; None if it cannot list them."""
        return self._active.simulator.visible_scene()

    def visible_state(self) -> SceneState:
        """Return the poses in the active simulator after the last step."""
        return self._active.simulator.visible_state()

    def due(self, episodes: int = 1) -> str | None:
        """Return the reason to recycle the active simulator before the next `episodes`; None: no reason."""
        return self._active.simulator.due(episodes)

    def reload_due(self) -> bool:
        """Return whether the active simulator must load its world again before the next episode."""
        return self._active.simulator.reload_due()

    def reload(self) -> None:
        """Load the world of the active simulator again.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the world is not loaded in time.
        """
        self._active.simulator.reload()

    def start(self) -> None:
        """Start the active simulator; begin to start the spare in the background.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the active simulator does not start in time.
        """
        for side in (self._active, self._spare):
            side.wanted = True
        self._active.simulator.start()
        self._spare.prepare()

    def restart(self) -> None:
        """Let the spare take over, and restart the other simulator in the background.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the spare cannot take over.
        """
        self._active, self._spare = self._spare, self._active
        self._spare.prepare()
        self._active.take_over()
        log.info(
            "standby took over", simulator=self.name, node=self._active.simulator.webots.supervisor_node_name
        )

    def stop(self) -> None:
        """Stop both simulators, in any state, and wait until no thread works on them."""
        with contextlib.ExitStack() as stack:
            for side in (self._active, self._spare):
                stack.callback(side.stop)

    def abandon(self) -> None:
        """Make a start or restart in another thread fail soon."""
        self._active.abandon()

    def pause(self) -> None:
        """Pause the active simulator; the spare is always paused."""
        self._active.simulator.pause()

    def unpause(self) -> None:
        """End the pause."""
        self._active.simulator.unpause()


class Side:
    """One of the two simulators, and the thread that prepares it as the spare.

    Attributes:
        simulator: the simulator; while the thread prepares it, only that thread may use it.
        wanted: whether the simulator may be started again.
    """

    def __init__(self, simulator: Simulator, limit: RestartLimit) -> None:
        self.simulator = simulator
        self._budget = RestartBudget(simulator.name, limit)
        self.wanted = True
        self._was_up = False
        self._preparation: Future[None] | None = None

    @property
    def state(self) -> StandbyState | None:
        """The state of this simulator as a spare; None if it is neither ready nor starting."""
        preparation = self._preparation  # read once, because another thread may set it
        if preparation is None:
            return None
        if not preparation.done():
            return StandbyState.STARTING
        return None if preparation.exception() else StandbyState.READY

    def prepare(self) -> Future[None]:
        """Begin to restart the simulator until it is up; do nothing if such a restart already runs."""
        if self._preparation is None or self._preparation.done():
            self._preparation = in_background(self._restart, f"standby-{self.simulator.name}")
        return self._preparation

    def take_over(self) -> None:
        """Wait until the simulator is up, at most for its start deadline; then unpause it.

        Raises:
            SimulatorDead, SimulatorHung, WrongData: the simulator did not start, or failed while it stood by.
        """
        simulator, deadline_s = self.simulator, self.simulator.start_deadline_s
        preparation = self._preparation or self.prepare()
        if wait([preparation], deadline_s).not_done:
            raise SimulatorHung(simulator.name, f"its standby was not ready within {deadline_s:g} s")
        preparation.result()
        if not simulator.webots.available():
            raise SimulatorDead(simulator.name, "its standby no longer responds")
        simulator.unpause()
        simulator.wear.begin()

    def abandon(self) -> None:
        """Make a running start fail soon, and do not begin another start."""
        self.wanted = False
        self.simulator.abandon()

    def stop(self) -> None:
        """Stop the simulator, in any state, and wait until no thread works on it."""
        self.wanted = False
        preparation, self._preparation = self._preparation, None
        while preparation is not None and not preparation.done():
            # The kill makes the start fail, and then the start's thread ends. A second kill may be needed,
            # because a process that has not started yet cannot be killed.
            self.abandon()
            wait([preparation], _ASK_AGAIN_S)
        self.simulator.stop()

    def _restart(self) -> None:
        while True:
            try:
                self._come_up()
            except SimulatorFault as fault:
                never_up = not self._was_up and isinstance(fault, WorldMisfit)
                if never_up or not self.wanted:
                    raise
                log.warning("standby did not start", simulator=self.simulator.name, fact=str(fault))
                self._spend(fault)
            else:
                self._was_up = True
                return

    def _come_up(self) -> None:
        simulator = self.simulator
        simulator.await_sidecar()
        simulator.stop()
        if not self.wanted:
            raise SimulatorDead(simulator.name, "its standby is no longer needed")
        simulator.start()
        simulator.pause()

    def _spend(self, fault: SimulatorFault) -> None:
        """Count one more start against the budget; raise the fault if the budget is spent."""
        try:
            self._budget.spend(fault)
        except FaultBudgetSpent as spent:
            log.error(
                "standby used up its restarts; it starts again only when it is needed",
                simulator=self.simulator.name,
                fact=str(spent),
            )
            raise fault from spent
