"""The text that `palaestra describe` prints about one job."""

from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime

from palaestra.api import Role, TrainingJob
from palaestra.api.attempt_status import Goodput, LastAttempt, LastEvaluation
from palaestra.api.status import Condition, LostPart, LostRun, ReplicaStatus, SuccessInterval
from palaestra.client import Event
from palaestra.view.durations import ago, short
from palaestra.view.tables import NOTHING, lines_of

INDENT = "  "
Row = tuple[str, str]


def describe(job: TrainingJob, created: datetime, now: datetime) -> list[str]:
    """Return the lines about a job; unknown values are left out."""
    lines = lines_of([(f"{name}:", value) for name, value in _facts(job, created, now) if value])
    if job.status.left_out:
        lines += ["", "Left out of the worlds:", *_indented(job.status.left_out)]
    lines += ["", "Conditions:", *_indented(_conditions(job.status.conditions, now))]
    for replica in job.status.replicas:
        lines += ["", *_replica(replica, now)]
    return lines


def happened(events: Sequence[Event], now: datetime) -> list[str]:
    """Return the lines about events: age, type, reason, object with container, message."""
    if not events:
        return ["none that the cluster still has"]
    rows = [
        (
            short((now - event.time).total_seconds()) + (f" (x{event.count})" if event.count > 1 else ""),
            "Warning" if event.warning else "Normal",
            event.reason,
            f"{event.about} ({event.container})" if event.container else event.about,
            " ".join(event.message.split()),
        )
        for event in events
    ]
    return lines_of([("AGE", "TYPE", "REASON", "ABOUT", "MESSAGE"), *rows])


def _facts(job: TrainingJob, created: datetime, now: datetime) -> Iterator[Row]:
    status, trainer, storage = job.status, job.spec.trainer, job.spec.storage
    yield "Name", job.metadata.name
    yield "Namespace", job.metadata.namespace
    yield "Created", ago(created, now)
    yield "Phase", str(status.phase or "not reconciled by an operator yet")
    yield "Suspended", "by spec.suspend" if job.spec.suspend else ""
    yield "Started", ago(status.start_time, now)
    yield "Ended", ago(status.completion_time, now)
    yield "Algorithm", f"{trainer.algorithm.name}, {trainer.steps:,} steps, seed {job.spec.seed}"
    yield "Environment", trainer.environment.id
    yield (
        "Simulators",
        ", ".join(
            f"{simulator.name}: {simulator.count} x {simulator.role}" for simulator in job.spec.simulators
        ),
    )
    yield "Queue", job.spec.scheduling.queue_name or ""
    if storage.ephemeral:
        yield "Storage", "in the pod, deleted with it"
    elif storage.existing_claim:
        yield "Storage", f"claim {storage.existing_claim}"
    else:
        yield "Storage", f"a claim of {storage.size} per replica, retain {storage.retain}"
    yield "Trainer image", trainer.image or (status.release.trainer if status.release else "")


def _conditions(conditions: Iterable[Condition], now: datetime) -> list[str]:
    rows = [
        (
            condition.type,
            condition.status,
            short((now - condition.last_transition_time).total_seconds()),
            condition.reason,
            condition.message,
        )
        for condition in conditions
    ]
    return lines_of([("TYPE", "STATUS", "SINCE", "REASON", "MESSAGE"), *rows]) if rows else ["none yet"]


def _replica(replica: ReplicaStatus, now: datetime) -> list[str]:
    heading = f"Replica {replica.index}: {replica.phase}"
    heading += f", attempt {replica.attempt}, pod {replica.pod.name}" if replica.pod else ""
    lines = lines_of([(f"{name}:", value) for name, value in _progress(replica, now) if value] or [("", "")])
    if replica.simulators:
        lines += ["Simulators:", *_indented(_simulators(replica))]
    if replica.last_attempt is not None:
        lines += ["Last attempt:", *_indented(_attempt(replica.last_attempt))]
    return [heading, *_indented(lines)]


def _progress(replica: ReplicaStatus, now: datetime) -> Iterator[Row]:
    yield "Why", ": ".join(part for part in (replica.reason, replica.message) if part)
    yield "Step", progress(replica)
    if replica.success_rate is not None:
        yield "Success rate", _success(replica.success_rate, replica.success_interval)
    if replica.mean_return is not None:
        yield "Mean return", f"{replica.mean_return:.4g}"
    if replica.last_evaluation is not None:
        yield "Evaluation", _evaluation(replica.last_evaluation)
    if replica.last_checkpoint is not None:
        yield "Checkpoint", f"step {replica.last_checkpoint.step:,}, {ago(replica.last_checkpoint.time, now)}"
    yield "Progress", ago(replica.last_progress, now)
    yield "Restarts", _counts(replica.restarts.model_dump())
    if replica.faults is not None:
        counts = replica.faults.model_dump()
        slow = counts.pop("slow")
        yield "Faults", _counts(counts)
        yield "Slow steps", f"{slow:,} (not faults)" if slow else ""
    yield "Memory kills", ", ".join(f"{kill.container} {kill.times}" for kill in replica.memory_kills)
    yield "Steps lost", f"{replica.steps_lost:,}" if replica.steps_lost else ""
    if replica.lost is not None:
        yield "Lost run", _lost(replica.lost, now)
    yield "Time spent", _shares(replica.goodput) if replica.goodput else ""


def progress(replica: ReplicaStatus) -> str:
    """Return a replica's step, speed and remaining time; empty while the step is unknown."""
    if replica.step is None:
        return ""
    text = f"{replica.step:,}"
    if replica.target:
        text += f" of {replica.target:,} ({replica.step / replica.target:.0%})"
    if replica.steps_per_second:
        text += f", {replica.steps_per_second:.0f} a second"
        if replica.target and replica.target > replica.step:
            text += f", about {short((replica.target - replica.step) / replica.steps_per_second)} to go"
    return text


def _success(rate: float, interval: SuccessInterval | None) -> str:
    if interval is None:
        return f"{rate:.0%} in the last evaluation"
    return (
        f"{rate:.0%} (95% interval {interval.low:.0%} to {interval.high:.0%}, {interval.episodes} episodes)"
    )


def _evaluation(evaluation: LastEvaluation) -> str:
    text = f"step {evaluation.step:,}"
    if evaluation.success_rate is not None:
        text += f", success rate {evaluation.success_rate:.0%}"
    if evaluation.mean_return is not None:
        text += f", mean return {evaluation.mean_return:.4g}"
    return text


def _lost(lost: LostRun, now: datetime) -> str:
    what = "claim" if lost.what is LostPart.CLAIM else "run directory"
    then = "" if lost.restarted is None else f", given up {ago(lost.restarted, now)}"
    return f"{what} at step {lost.step:,}{then}"


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in counts.items() if count)


def _shares(goodput: Goodput) -> str:
    spent = goodput.model_dump(exclude_none=True)
    total = sum(spent.values())
    return ", ".join(f"{cause} {seconds / total:.0%}" for cause, seconds in spent.items() if seconds)


def _simulators(replica: ReplicaStatus) -> list[str]:
    rows = []
    for simulator in replica.simulators:
        state = "given up" if simulator.given_up else "flapping" if simulator.flapping else simulator.state
        fault = simulator.last_fault or NOTHING
        rows.append(
            (
                simulator.name,
                Role(simulator.role),
                state,
                str(simulator.restarts),
                simulator.standby or NOTHING,
                fault,
            )
        )
    return lines_of([("NAME", "ROLE", "STATE", "RESTARTS", "STANDBY", "LAST FAULT"), *rows])


def _attempt(attempt: LastAttempt) -> list[str]:
    lines = [f"{attempt.attempt}, {attempt.reason}: {attempt.message}"]
    if attempt.log:
        lines += ["last lines of its log:", *_indented(list(attempt.log))]
    return lines


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"{INDENT}{line}".rstrip() for line in lines]
