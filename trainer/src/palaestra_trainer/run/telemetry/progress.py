"""The progress of a run, in one object for all its readers.

The training loop, the VecEnv and the evaluations report to the `Progress` object, from several threads.
/status, /metrics, the log, the summary and the watchdog read the object.
"""

from __future__ import annotations

import threading
import time
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass, field, replace
from statistics import fmean
from types import MappingProxyType
from typing import Any

from palaestra_protocol.pod.enums import Role
from palaestra_protocol.pod.status import (
    Cause,
    CheckpointStatus,
    EvaluationStatus,
    FaultKind,
    FaultRecord,
    SuccessInterval,
    TrainerStatus,
)
from palaestra_protocol.scene import SceneState
from palaestra_trainer.environments.infos import extra_steps
from palaestra_trainer.episodes.evaluation import EvaluationResult
from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.run.telemetry.fault_log import FaultLog
from palaestra_trainer.run.telemetry.goodput import GoodputLedger
from palaestra_trainer.run.telemetry.metric_values import EPISODES_IN_MEAN, MetricValues
from palaestra_trainer.run.telemetry.simulator_status import AskLeftOut, AskStandby, SimulatorStatuses

SPEED_WINDOW_S = 30.0
PHASES: Mapping[Cause, str] = MappingProxyType(
    {
        Cause.STARTING: "starting",
        Cause.EVALUATING: "evaluating",
        Cause.CHECKPOINTING: "saving",
        Cause.RECOVERING: "recovering",
        Cause.RECYCLING: "recycling",
    }
)


@dataclass(slots=True)
class Counters:
    """The counts over all attempts of a run; checkpoints save them.

    Attributes:
        episodes: number of collected episodes that ended without a fault.
        faults: number of faults by kind: `dead`, `hung` and `wrong_data`; `slow` counts slow steps, which are
            not faults.
        restarts: number of restarts of simulators after faults.
        recycled: number of restarts of healthy simulators.
        given_up: number of failed simulators that are not restarted, because the run continues without them.
        extra_steps: simulation steps taken because a message was late.
        steps_lost: number of valid steps that were lost, see `TrainerStatus`.
        goodput: seconds spent, by cause.
    """

    episodes: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    restarts: int = 0
    recycled: int = 0
    given_up: int = 0
    extra_steps: int = 0
    steps_lost: int = 0
    goodput: dict[str, float] = field(default_factory=dict)

    @property
    def seconds(self) -> float:
        """Wall-clock seconds of the run."""
        return sum(self.goodput.values())

    @property
    def broken(self) -> int:
        """Number of faults of all kinds except `slow`."""
        return self.faults.total() - self.faults[FaultKind.SLOW]

    def to_json(self) -> dict[str, Any]:
        """Return the counters as JSON data."""
        own = {name: getattr(self, name) for name in self.__slots__}
        return own | {"faults": dict(self.faults), "goodput": dict(self.goodput)}

    @classmethod
    def from_json(cls, content: Mapping[str, Any]) -> Counters:
        """Return the counters that `to_json` wrote."""
        known: dict[str, Any] = {name: content[name] for name in cls.__slots__ if name in content}
        known["faults"] = Counter(known.get("faults", {}))
        return cls(**known)


class Progress:
    """The progress of a run, and the `Watcher` of its simulators; any thread may call its methods.

    Attributes:
        step: number of valid environment steps so far, over all attempts.
        target: number of steps at which the run ends.
        counters: counts over all attempts, without the time of this attempt; `counted` adds that time.
        success_rate: success rate of this attempt's last evaluation or confirmation, after `completed` of the
            best policy; None before an evaluation, or if the environment does not report success.
        success_interval: the interval around `success_rate`; None if the rate is None.
        last_evaluation: the newest evaluation, over all attempts; None before the first evaluation.
        checkpoint: the newest checkpoint; None before the first checkpoint.
        attempt: number of this attempt in the run directory; None before the attempt is recorded.
        figures: values of this attempt only, for /metrics.
        fault_log: the file of faults; None: faults are not written to a file.
        moments: a function that returns the episode and step of each collecting simulator, for viewers.
    """

    def __init__(
        self,
        target: int,
        simulators: Sequence[tuple[str, Role]],
        clock: Callable[[], float] = time.monotonic,
    ) -> None:
        self.step = 0
        self.target = target
        self.counters = Counters()
        self.success_rate: float | None = None
        self.success_interval: SuccessInterval | None = None
        self.last_evaluation: EvaluationStatus | None = None
        self.checkpoint: CheckpointStatus | None = None
        self.attempt: int | None = None
        self.figures = MetricValues()
        self.fault_log: FaultLog | None = None
        self.moments: Callable[[], Mapping[str, SceneState]] = dict
        self._clock = clock
        self._lock = threading.Lock()
        self._standings = SimulatorStatuses(simulators, clock)
        self._goodput = GoodputLedger(clock)
        self._returns: deque[float] = deque(maxlen=EPISODES_IN_MEAN)
        self._samples: deque[tuple[float, int]] = deque()
        self._moved = clock()
        self._moved_at: float | None = None

    @property
    def phase(self) -> str:
        """The current activity: starting, training, evaluating, saving, recovering or recycling."""
        return PHASES.get(self._goodput.cause, "training")

    @property
    def awaits_simulators(self) -> bool:
        """Whether the training thread currently waits for simulators."""
        return self._goodput.cause in {Cause.TRANSPORT, Cause.RECOVERING, Cause.RECYCLING}

    def spending(self, cause: Cause) -> AbstractContextManager[None]:
        """Count the time inside the context under `cause`, see `GoodputLedger`."""
        return self._goodput.spending(cause)

    def stepped(self, steps: int) -> None:
        """Record that a simulator has stepped, in training or evaluation."""
        del steps
        self._moved = self._clock()
        self._moved_at = time.time()

    def resumed(self, step: int, counters: Counters, evaluation: EvaluationStatus | None = None) -> None:
        """Continue with the checkpoint at `step`, its counters and the last evaluation before it."""
        self.step = step
        self.last_evaluation = evaluation
        self.counters = replace(counters, faults=Counter(counters.faults))
        self.saved(step)

    def returns(self) -> list[float]:
        """Return the returns of the last episodes, the newest last."""
        with self._lock:
            return list(self._returns)

    def recall(self, returns: Sequence[float]) -> None:
        """Restore the returns of the last episodes before this attempt."""
        self._returns.extend(returns)

    def fault(self, simulator: str, fault: SimulatorFault, steps_lost: int, *, restarts: bool = True) -> None:
        """Count a fault and the steps of the episode that it truncated.

        Mark the simulator as down if it restarts.
        """
        record = FaultRecord(
            time=timestamp(time.time()),
            simulator=simulator,
            kind=fault.kind,
            fact=str(fault),
            step=self.step,
        )
        with self._lock:
            self.counters.steps_lost += steps_lost
            self.counters.faults[fault.kind] += 1
            self._goodput.in_vain()
            self._standings.broke(record)
            if not restarts:
                self._standings.is_up(simulator)
        if self.fault_log is not None:
            self.fault_log.broke(record, steps_lost)
            if not restarts:
                self.fault_log.is_up(simulator)

    def slow(self, simulator: str, seconds: float) -> None:
        """Count a step that took much longer than usual, which is not a fault."""
        del seconds
        with self._lock:
            self.counters.faults[FaultKind.SLOW] += 1
            self._standings.was_slow(simulator)

    def flapping(self, simulator: str) -> None:
        """Mark a simulator that fails repeatedly as flapping."""
        with self._lock:
            self._standings.flaps(simulator)

    def given_up(self, simulator: str) -> None:
        """Mark a simulator as given up; the run continues without it."""
        with self._lock:
            self.counters.given_up += 1
            self._standings.gave_up(simulator)

    def add(self, simulator: str, role: Role) -> None:
        """Add a simulator, unless it is already known."""
        with self._lock:
            self._standings.add(simulator, role)

    def has_standby(self, simulator: str, ask: AskStandby) -> None:
        """Set the function, called by any thread, that returns the state of the simulator's standby."""
        self._standings.has_standby(simulator, ask)

    def reports_left_out(self, simulator: str, ask: AskLeftOut) -> None:
        """Set the function, called by any thread, that returns the parts that the simulator left out."""
        self._standings.reports_left_out(simulator, ask)

    def left_out(self) -> tuple[str, ...]:
        """Return the parts that simulators left out of their worlds, as lines that begin with the group."""
        return self._standings.left_out()

    def started(self, simulator: str) -> None:
        """Mark a simulator as up, for the first time in this attempt."""
        with self._lock:
            self._standings.is_up(simulator)

    def restarted(self, simulator: str, *, recycled: bool) -> None:
        """Count a restart of a simulator and mark it as up."""
        with self._lock:
            self._standings.is_up(simulator)
            if recycled:
                self.counters.recycled += 1
                self._standings.recycled(simulator)
            else:
                self.counters.restarts += 1
                self._standings.restarted(simulator)
        if self.fault_log is not None:
            self.fault_log.is_up(simulator)

    def collected(self, step: int, infos: Sequence[Mapping[str, Any]]) -> None:
        """Set the step of training, and count a vector step from its infos."""
        with self._lock:
            self.step = step
            for info in infos:
                self.counters.extra_steps += extra_steps(info)
                if (episode := info.get("episode")) is not None:
                    self.counters.episodes += 1
                    self._returns.append(episode["r"])
                    self.figures.played(info)
            now = self._clock()
            if not self._samples or now - self._samples[-1][0] >= 1.0:
                self._samples.append((now, step))
                while now - self._samples[0][0] > SPEED_WINDOW_S:
                    self._samples.popleft()

    def evaluated(self, evaluation: EvaluationResult) -> None:
        """Record an evaluation of the policy."""
        with self._lock:
            self.success_rate = evaluation.success_rate
            self.success_interval = evaluation.success_interval
        self.figures.evaluated(evaluation)

    def completed(self, best: Mapping[str, Any]) -> None:
        """Set the success rate to that of the best policy, from the record of its evaluation."""
        interval = best.get("success_interval")
        with self._lock:
            self.success_rate = best.get("success_rate")
            self.success_interval = None if interval is None else SuccessInterval.from_json(interval)

    def saved(self, step: int) -> None:
        """Record that a checkpoint was written."""
        self.checkpoint = CheckpointStatus(step=step, time=timestamp(time.time()))

    def counted(self, kept: int | None = None) -> Counters:
        """Return the current counters, or those of a run that resumes from step `kept`."""
        lost = 0 if kept is None else max(self.step - kept, 0)
        with self._lock:
            so_far, before = self.counters, self.counters.goodput
            return replace(
                so_far,
                faults=Counter(so_far.faults),
                steps_lost=so_far.steps_lost + lost,
                goodput={
                    cause: before.get(cause, 0.0) + seconds
                    for cause, seconds in self._goodput.seconds().items()
                },
            )

    def scalars(self) -> dict[str, float]:
        """Return the values to plot over the steps, by their names in TensorBoard."""
        counters = self.counted()
        faults = {f"simulators/faults_{kind}": counters.faults[kind] for kind in FaultKind}
        spent = {f"goodput/{cause}_s": seconds for cause, seconds in counters.goodput.items()}
        totals = {
            "simulators/faults": counters.broken,
            "simulators/restarts": counters.restarts,
            "simulators/steps_lost": counters.steps_lost,
        }
        return totals | faults | spent

    def faults_by_kind(self) -> Mapping[tuple[str, ...], int]:
        """Return the number of faults in this attempt by simulator and kind."""
        with self._lock:
            return self._standings.faults_by_kind()

    def restarts_by_cause(self) -> Mapping[tuple[str, ...], int]:
        """Return the number of restarts in this attempt by simulator and cause: a fault kind or recycling."""
        with self._lock:
            return self._standings.restarts_by_cause()

    def restarts(self) -> int:
        """Return the number of restarts of simulators after faults in this attempt.

        This method never blocks, because the watchdog calls it while other threads hang.
        """
        return self._standings.restarts()

    def faults(self) -> tuple[FaultRecord, ...]:
        """Return the last faults of this attempt, the newest last; this method never blocks."""
        return tuple(self._standings.faults)

    def down(self) -> list[str]:
        """Return the names of the simulators that are not up; this method never blocks."""
        return self._standings.down()

    def idle_s(self) -> float:
        """Return the seconds since the last environment step of any simulator, or since the start."""
        return self._clock() - self._moved

    def steps_per_second(self) -> float | None:
        """Return the speed over the last 30 seconds; None before a second has passed."""
        with self._lock:
            if len(self._samples) <= 1:
                return None
            then, before = self._samples[0]
            return (self.step - before) / max(self._clock() - then, 1e-9)

    def status(self) -> TrainerStatus:
        """Return the content of /status."""
        speed, counters = self.steps_per_second(), self.counted()
        with self._lock:
            return TrainerStatus(
                step=self.step,
                target=self.target,
                episodes=counters.episodes,
                mean_return=fmean(self._returns) if self._returns else None,
                success_rate=self.success_rate,
                success_interval=self.success_interval,
                steps_per_second=speed,
                simulators=self._standings.statuses(),
                last_checkpoint=self.checkpoint,
                last_progress=None if self._moved_at is None else timestamp(self._moved_at),
                last_progress_age_s=None if self._moved_at is None else round(max(self.idle_s(), 0.0), 3),
                phase=self.phase,
                attempt=self.attempt,
                faults={kind.value: counters.faults[kind] for kind in FaultKind},
                goodput={cause: round(seconds, 3) for cause, seconds in counters.goodput.items()},
                steps_lost=counters.steps_lost,
                left_out=self._standings.left_out(),
                last_evaluation=self.last_evaluation,
            )


def timestamp(seconds: float) -> str:
    """Return seconds since the epoch as RFC 3339, in UTC."""
    return time.strftime("%Y-%m-%dT%H:%M:%SZ", time.gmtime(seconds))
