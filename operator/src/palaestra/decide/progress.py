"""The trainer's last report as fields of the status, and the wait for the trainer's next progress.

If the trainer no longer reports a value, the last value stays, because an unknown value is not zero. Only the
speed is removed, because an old speed is not the current speed.
"""

from datetime import datetime

from palaestra.api import Role
from palaestra.api.attempt_status import Faults, Goodput, LastEvaluation
from palaestra.api.status import (
    TERMINAL,
    LastCheckpoint,
    Phase,
    SimulatorStatus,
    SuccessInterval,
)
from palaestra.api.text import one_line
from palaestra.decide.clocks import Wait, after
from palaestra.decide.replica_context import ReplicaContext
from palaestra.decide.restart_counts import of_this_run
from palaestra.observe.json_access import MOST_COUNT, as_time
from palaestra_protocol.control import SidecarState
from palaestra_protocol.pod import status as protocol
from palaestra_protocol.pod.status import CheckpointStatus, EvaluationStatus, Termination, TrainerStatus

EVALUATING = "evaluating"  # the trainer's phase during an evaluation, in which the trainer does not learn
LONGEST_NAME = 63  # characters of a simulator's name; the names in a plan have 23 characters at most
LONGEST_FAULT = 200


def progress(situation: ReplicaContext, phase: Phase) -> dict[str, object]:
    """Return the fields of a replica's status from its trainer's report.

    A trainer that has not read its run directory yet reports step 0, even after earlier attempts. Then the
    earlier step stays.
    """
    if situation.seen.pod is not None and situation.seen.pod.uid not in of_this_run(
        situation.old, situation.seen.pods
    ):
        return {"steps_per_second": None}
    polled = situation.seen.polled.status if situation.seen.polled and phase not in TERMINAL else None
    ended_with = situation.seen.termination
    told_last = ended_with or polled
    fields: dict[str, object] = {"steps_per_second": None, "last_progress": last_progress(situation)}
    if told_last is not None and (step := _step(told_last)) is not None:
        fields["step"] = step
        fields["success_rate"] = _figure(told_last.success_rate, situation.old.success_rate)
        fields["success_interval"] = _interval(told_last.success_interval) or situation.old.success_interval
        fields["last_evaluation"] = _evaluation(told_last.last_evaluation) or situation.old.last_evaluation
        fields["last_checkpoint"] = _checkpoint(told_last.last_checkpoint) or situation.old.last_checkpoint
    if polled is not None and ended_with is None:
        fields |= {
            "target": min(polled.target, MOST_COUNT),
            "mean_return": _figure(polled.mean_return, situation.old.mean_return),
            "steps_per_second": _figure(polled.steps_per_second, None),
            "simulators": _simulators(polled),
            **_spent(situation, polled),
        }
    return fields


def last_progress(situation: ReplicaContext) -> datetime | None:
    """Return the time of the last step of the current attempt or of its evaluation, or None.

    The result is None until the attempt has reported training. The step of an environment alone is not
    progress, because the trainer may not learn from that step.
    """
    same_attempt = situation.old.pod is not None and situation.counted.pod == situation.old.pod
    known = situation.old.last_progress if same_attempt else None
    wait = standstill(situation)
    if wait is None or situation.seen.polled is None:
        return known
    status = situation.seen.polled.status
    step = _step(status)
    moved = (step is not None and step != situation.old.step) or status.phase == EVALUATING
    if known is not None and not moved:
        return known
    return after(situation.now, -int(situation.waited_s(wait)))


def standstill(situation: ReplicaContext) -> Wait | None:
    """Return the wait for the next step of training or evaluation; None if the trainer does not train.

    The wait began at the last step of an environment. The trainer reports the age of this step. It also
    reports the time of this step by its own clock, so the operator compares this time only with the trainer's
    earlier reports.
    """
    polled = situation.seen.polled
    if polled is None or not situation.trains or situation.pod is None:
        return None
    status = polled.status
    evaluates = status.phase == EVALUATING
    step = f"evaluates, {status.last_progress}" if evaluates else f"step {_step(status)}"
    begun_s = polled.at_s - (status.last_progress_age_s or 0.0)
    return Wait(key=("stalled", situation.pod.uid, step), seconds=0.0, begun_s=begun_s)


def _step(report: TrainerStatus | Termination) -> int | None:
    """Return the step of a run; None if the trainer has not read it yet."""
    return None if report.attempt is None and report.step == 0 else min(report.step, MOST_COUNT)


def _spent(situation: ReplicaContext, polled: TrainerStatus) -> dict[str, object]:
    """Return goodput, faults and lost steps of the run; {} if the trainer's release has no goodput."""
    if not polled.goodput:
        return {}
    before = situation.old.goodput or Goodput()
    seconds = {cause: min(int(spent), MOST_COUNT) for cause, spent in polled.goodput.items()}
    faults = {kind: min(times, MOST_COUNT) for kind, times in polled.faults.items()}
    return {
        "goodput": before.model_copy(update=seconds),
        "faults": (situation.old.faults or Faults()).model_copy(update=faults),
        "steps_lost": min(polled.steps_lost, MOST_COUNT),
    }


def _simulators(polled: TrainerStatus) -> tuple[SimulatorStatus, ...]:
    return tuple(
        SimulatorStatus(
            name=one_line(simulator.name, LONGEST_NAME) or "unnamed",
            role=Role(simulator.role),
            state=SidecarState(simulator.state),
            restarts=min(simulator.restarts, MOST_COUNT),
            last_fault=None
            if simulator.last_fault is None
            else one_line(simulator.last_fault, LONGEST_FAULT),
            flapping=simulator.flapping,
            given_up=simulator.given_up,
            standby=simulator.standby,
        )
        for simulator in polled.simulators
    )


def _checkpoint(checkpoint: CheckpointStatus | None) -> LastCheckpoint | None:
    at = as_time(checkpoint.time) if checkpoint is not None else None
    if checkpoint is None or at is None:
        return None
    return LastCheckpoint(step=min(checkpoint.step, MOST_COUNT), time=at)


def _evaluation(evaluation: EvaluationStatus | None) -> LastEvaluation | None:
    if evaluation is None:
        return None
    return LastEvaluation(
        step=min(evaluation.step, MOST_COUNT),
        success_rate=_figure(evaluation.success_rate, None),
        mean_return=_figure(evaluation.mean_return, None),
    )


def _figure(new: float | None, old: float | None) -> float | None:
    """Return the new value, rounded to four decimals; the old value if the new value is None."""
    return old if new is None else round(new, 4)


def _interval(interval: protocol.SuccessInterval | None) -> SuccessInterval | None:
    return (
        None
        if interval is None
        else SuccessInterval(low=interval.low, high=interval.high, episodes=interval.episodes)
    )
