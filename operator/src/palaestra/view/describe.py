"""The text that `palaestra describe` prints about one job."""

from collections.abc import Iterable, Iterator, Sequence
from datetime import datetime

from palaestra.api import Role, TrainingJob
from palaestra.api.history import Goodput, LastAttempt
from palaestra.api.status import Condition, ReplicaStatus, SuccessInterval
from palaestra.client import Happening
from palaestra.view.durations import ago, short
from palaestra.view.tables import NOTHING, lines_of

INDENT = "  "
Row = tuple[str, str]


def describe(job: TrainingJob, created: datetime, now: datetime) -> list[str]:
    """Return the lines about a job, without unknown values."""
    lines = lines_of([(f"{name}:", told) for name, told in _facts(job, created, now) if told])
    lines += ["", "Conditions:", *_indented(_conditions(job.status.conditions, now))]
    for replica in job.status.replicas:
        lines += ["", *_replica(replica, now)]
    return lines


def happened(happenings: Sequence[Happening], now: datetime) -> list[str]:
    """Return the lines about events: age, type, reason, object with container, message."""
    if not happenings:
        return ["none that the cluster still has"]
    rows = [
        (
            short((now - each.time).total_seconds()) + (f" (x{each.count})" if each.count > 1 else ""),
            "Warning" if each.warning else "Normal",
            each.reason,
            f"{each.about} ({each.container})" if each.container else each.about,
            " ".join(each.message.split()),
        )
        for each in happenings
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
    yield "Simulators", ", ".join(f"{each.name}: {each.count} x {each.role}" for each in job.spec.simulators)
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
            each.type,
            each.status,
            short((now - each.last_transition_time).total_seconds()),
            each.reason,
            each.message,
        )
        for each in conditions
    ]
    return lines_of([("TYPE", "STATUS", "SINCE", "REASON", "MESSAGE"), *rows]) if rows else ["none yet"]


def _replica(replica: ReplicaStatus, now: datetime) -> list[str]:
    heading = f"Replica {replica.index}: {replica.phase}"
    heading += f", attempt {replica.attempt}, pod {replica.pod.name}" if replica.pod else ""
    lines = lines_of([(f"{name}:", told) for name, told in _progress(replica, now) if told] or [("", "")])
    if replica.simulators:
        lines += ["Simulators:", *_indented(_simulators(replica))]
    if replica.last_attempt is not None:
        lines += ["Last attempt:", *_indented(_attempt(replica.last_attempt))]
    return [heading, *_indented(lines)]


def _progress(replica: ReplicaStatus, now: datetime) -> Iterator[Row]:
    yield "Why", ": ".join(each for each in (replica.reason, replica.message) if each)
    yield "Step", progress(replica)
    if replica.success_rate is not None:
        yield "Success rate", _success(replica.success_rate, replica.success_interval)
    if replica.mean_return is not None:
        yield "Mean return", f"{replica.mean_return:.4g}"
    if replica.last_checkpoint is not None:
        yield "Checkpoint", f"step {replica.last_checkpoint.step:,}, {ago(replica.last_checkpoint.time, now)}"
    yield "Progress", ago(replica.last_progress, now)
    yield "Restarts", _counts(replica.restarts.model_dump())
    if replica.faults is not None:
        counts = replica.faults.model_dump()
        slow = counts.pop("slow")
        yield "Faults", _counts(counts)
        yield "Slow steps", f"{slow:,} (not faults)" if slow else ""
    yield "Memory kills", ", ".join(f"{each.container} {each.times}" for each in replica.memory_kills)
    yield "Steps lost", f"{replica.steps_lost:,}" if replica.steps_lost else ""
    yield "Time spent", _shares(replica.goodput) if replica.goodput else ""


def progress(replica: ReplicaStatus) -> str:
    """Return a replica's step, speed and remaining time; empty while the step is unknown."""
    if replica.step is None:
        return ""
    told = f"{replica.step:,}"
    if replica.target:
        told += f" of {replica.target:,} ({replica.step / replica.target:.0%})"
    if replica.steps_per_second:
        told += f", {replica.steps_per_second:.0f} a second"
        if replica.target and replica.target > replica.step:
            told += f", about {short((replica.target - replica.step) / replica.steps_per_second)} to go"
    return told


def _success(rate: float, interval: SuccessInterval | None) -> str:
    if interval is None:
        return f"{rate:.0%} in the last evaluation"
    return (
        f"{rate:.0%} (95% interval {interval.low:.0%} to {interval.high:.0%}, {interval.episodes} episodes)"
    )


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{name.replace('_', ' ')} {count}" for name, count in counts.items() if count)


def _shares(goodput: Goodput) -> str:
    spent = goodput.model_dump(exclude_none=True)
    total = sum(spent.values())
    return ", ".join(f"{cause} {seconds / total:.0%}" for cause, seconds in spent.items() if seconds)


def _simulators(replica: ReplicaStatus) -> list[str]:
    rows = []
    for each in replica.simulators:
        state = "given up" if each.given_up else "flapping" if each.flapping else each.state
        fault = each.last_fault or NOTHING
        rows.append((each.name, Role(each.role), state, str(each.restarts), each.standby or NOTHING, fault))
    return lines_of([("NAME", "ROLE", "STATE", "RESTARTS", "STANDBY", "LAST FAULT"), *rows])


def _attempt(attempt: LastAttempt) -> list[str]:
    lines = [f"{attempt.attempt}, {attempt.reason}: {attempt.message}"]
    if attempt.log:
        lines += ["last lines of its log:", *_indented(list(attempt.log))]
    return lines


def _indented(lines: Iterable[str]) -> list[str]:
    return [f"{INDENT}{line}".rstrip() for line in lines]
