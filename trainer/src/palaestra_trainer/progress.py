"""How far the run is: the one place that knows, for everybody who shows it.

The training loop, the VecEnv and the evaluations tell it what happens, each
from its own thread; /status, /metrics, the display, the summary and the
watchdog ask it.
"""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from statistics import fmean
from typing import Any

from palaestra_sim.protocol.status import CheckpointStatus, SimulatorStatus, TrainerStatus
from palaestra_trainer.configuration import Role
from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.evaluation import Evaluation

EPISODES_IN_MEAN = 100  # as in Stable-Baselines3's rollout/ep_rew_mean
SPEED_WINDOW_S = 30.0


@dataclass(slots=True)
class _Simulator:
    role: Role
    state: str = "starting"
    restarts: int = 0
    last_fault: str | None = None


@dataclass(slots=True)
class Counters:
    """What is counted over all attempts of a run, and therefore kept in its checkpoints.

    Attributes:
        episodes: collected episodes that ended without a fault.
        faults: by kind: dead, hung, wrong_data.
        restarts: of simulators, after faults.
        recycled: restarts of healthy simulators.
        extra_steps: simulation steps taken because a message had not come.
        seconds: wall time of training.
    """

    episodes: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    restarts: int = 0
    recycled: int = 0
    extra_steps: int = 0
    seconds: float = 0.0

    def to_json(self) -> dict[str, Any]:
        """Return them as JSON data."""
        return {name: getattr(self, name) for name in self.__slots__} | {"faults": dict(self.faults)}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Counters:
        """Return the counters that `to_json` wrote."""
        known: dict[str, Any] = {name: content[name] for name in cls.__slots__ if name in content}
        known["faults"] = Counter(known.get("faults", {}))
        return cls(**known)


class Progress:
    """Where a run stands; a `Watcher` of its simulators. All methods may be called from any thread.

    Attributes:
        step: valid environment steps so far, over all attempts.
        target: steps at which the run ends.
        phase: what it does now: starting, training, evaluating, saving.
        counters: what is counted over all attempts.
        success_rate: that of this attempt's last evaluation; None before it.
        checkpoint: the newest checkpoint; None without one.
        attempt: this one's number in the run directory's record; None before it is recorded.
    """

    def __init__(
        self,
        target: int,
        simulators: Sequence[tuple[str, Role]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.step = 0
        self.target = target
        self.phase = "starting"
        self.counters = Counters()
        self.success_rate: float | None = None
        self.checkpoint: CheckpointStatus | None = None
        self.attempt: int | None = None
        self._clock = clock
        self._lock = threading.Lock()
        self._simulators = {name: _Simulator(role=role) for name, role in simulators}
        self._returns: deque[float] = deque(maxlen=EPISODES_IN_MEAN)
        self._samples: deque[tuple[float, int]] = deque()
        self._moved = self._counted = clock()
        self._moved_at: float | None = None

    def stepped(self, steps: int) -> None:
        """Some simulator took environment steps, in training or evaluation."""
        del steps
        self._moved = self._clock()
        self._moved_at = time.time()

    def resumed(self, step: int) -> None:
        """The run goes on from the checkpoint at `step`: whoever asks is told so from now on."""
        self.step = step
        self.saved(step)

    def fault(self, simulator: str, fault: SimulatorFault) -> None:
        """Count a fault of a simulator, which is down from now on."""
        with self._lock:
            self.counters.faults[fault.kind] += 1
            entry = self._simulators[simulator]
            entry.state, entry.last_fault = "failed", str(fault)

    def started(self, simulator: str) -> None:
        """A simulator is up for the first time in this attempt."""
        with self._lock:
            self._simulators[simulator].state = "ready"

    def restarted(self, simulator: str, *, recycled: bool) -> None:
        """Count a restart of a simulator, which is up from now on."""
        with self._lock:
            self._simulators[simulator].state = "ready"
            if recycled:
                self.counters.recycled += 1
            else:
                self.counters.restarts += 1
                self._simulators[simulator].restarts += 1

    def ready(self) -> None:
        """All simulators are up."""
        with self._lock:
            for simulator in self._simulators.values():
                simulator.state = "ready"

    def collected(self, step: int, infos: Sequence[Mapping[str, Any]]) -> None:
        """Training is at `step`, after a vector step with these infos."""
        with self._lock:
            self.step = step
            for info in infos:
                self.counters.extra_steps += int(info.get("extra_steps", 0))
                if (episode := info.get("episode")) is not None:
                    self.counters.episodes += 1
                    self._returns.append(episode["r"])
            now = self._clock()
            if not self._samples or now - self._samples[-1][0] >= 1.0:
                self._samples.append((now, step))
                while now - self._samples[0][0] > SPEED_WINDOW_S:
                    self._samples.popleft()

    def evaluated(self, evaluation: Evaluation) -> None:
        """The policy was evaluated."""
        self.success_rate = evaluation.success_rate

    def saved(self, step: int) -> None:
        """A checkpoint was written."""
        self.checkpoint = CheckpointStatus(step=step, time=timestamp(time.time()))

    def count_time(self) -> Counters:
        """Add the seconds since the last call, or since the start, to the counters; return them."""
        with self._lock:
            now = self._clock()
            self.counters.seconds += now - self._counted
            self._counted = now
            return self.counters

    def restarts(self) -> int:
        """Return the restarts of simulators after faults, in this attempt.

        Waits for nobody: the watchdog asks when the others hang.
        """
        return sum(simulator.restarts for simulator in self._simulators.values())

    def idle_s(self) -> float:
        """Return the seconds since the last environment step of any simulator, or since the start."""
        return self._clock() - self._moved

    def steps_per_second(self) -> float | None:
        """Return the speed of the last half minute; None before a second has passed."""
        with self._lock:
            if len(self._samples) < 2:  # noqa: PLR2004 - a speed needs two points
                return None
            (then, before), (_, _) = self._samples[0], self._samples[-1]
            return (self.step - before) / max(self._clock() - then, 1e-9)

    def status(self) -> TrainerStatus:
        """Return what /status tells."""
        speed = self.steps_per_second()
        with self._lock:
            return TrainerStatus(
                step=self.step,
                target=self.target,
                episodes=self.counters.episodes,
                mean_return=fmean(self._returns) if self._returns else None,
                success_rate=self.success_rate,
                steps_per_second=speed,
                simulators=tuple(
                    SimulatorStatus(
                        name=name,
                        role=simulator.role,
                        state=simulator.state,
                        restarts=simulator.restarts,
                        last_fault=simulator.last_fault,
                    )
                    for name, simulator in self._simulators.items()
                ),
                last_checkpoint=self.checkpoint,
                last_progress=None if self._moved_at is None else timestamp(self._moved_at),
                phase=self.phase,
                attempt=self.attempt,
            )


def timestamp(seconds: float) -> str:
    """Return seconds since the epoch as RFC 3339, in UTC."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds))
