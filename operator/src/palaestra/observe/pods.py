"""Convert the JSON of a pod into a `PodView`."""

from datetime import UTC, datetime
from typing import Any

from palaestra.observe.json_access import condition, count, holds, part, parts, text, time
from palaestra.observe.models import ContainerExit, ContainerKind, ContainerView, PodView, Raw
from palaestra.plan.pod import GRACE_S
from palaestra_protocol.pod.status import ExitCode

MOST_MESSAGE = 4096  # Kubernetes' limit for a termination message
BEGINNING = datetime(1970, 1, 1, tzinfo=UTC)  # the replacement for an unreadable time
UNSCHEDULABLE = frozenset({"Unschedulable", "SchedulerError"})
GRACE = "deletionGracePeriodSeconds"
# Exit codes of a trainer that a signal ended.
BY_SIGNAL = frozenset({ExitCode.INTERRUPTED, 128 + 9, 128 + 15})


def pod_view(raw: Raw) -> PodView:
    """Return the view of a pod; absent values are empty."""
    status, metadata = part(raw, "status"), part(raw, "metadata")
    scheduled = condition(raw, "PodScheduled")
    return PodView(
        name=text(metadata, "name", 253),
        uid=text(metadata, "uid", 253),
        created=time(metadata, "creationTimestamp") or BEGINNING,
        version=text(metadata, "resourceVersion", 253),
        phase=text(status, "phase", 20) or "Pending",
        started=time(status, "startTime"),
        reason=text(status, "reason", 60),
        message=text(status, "message"),
        ready=holds(raw, "Ready"),
        mounted=holds(raw, "PodReadyToStartContainers"),
        node=text(part(raw, "spec"), "nodeName", 253),
        unschedulable=text(scheduled, "message") if _unschedulable(scheduled) else "",
        disruption=_disruption(raw),
        gone_by=time(metadata, "deletionTimestamp"),
        grace_s=count(metadata, GRACE) if GRACE in metadata else GRACE_S,
        containers=_containers(raw),
        claims=claims(part(raw, "spec")),
    )


def dropped(view: PodView) -> tuple[str, ...]:
    """Return the names of containers that are init containers but should be sidecars."""
    return tuple(
        container.name
        for container in view.containers
        if container.kind is ContainerKind.INIT and container.simulates
    )


def was_signalled(raw: Raw) -> bool:
    """Return whether a signal ended the trainer of a pod, and the pod's status does not contain the cause."""
    view = pod_view(raw)
    ended = view.trainer.exit if view.phase == "Failed" and view.trainer is not None else None
    shown = view.disruption or view.reason or view.gone_by is not None
    return ended is not None and ended.code in BY_SIGNAL and ended.reason != "OOMKilled" and not shown


def claims(spec: dict[str, Any]) -> frozenset[str]:
    """Return the names of the PersistentVolumeClaims that a pod's spec mounts."""
    names = (
        text(part(volume, "persistentVolumeClaim"), "claimName", 253) for volume in parts(spec, "volumes")
    )
    return frozenset(name for name in names if name)


def _unschedulable(scheduled: dict[str, Any]) -> bool:
    return scheduled.get("status") == "False" and text(scheduled, "reason") in UNSCHEDULABLE


def _disruption(raw: Raw) -> str:
    if not holds(raw, "DisruptionTarget"):
        return ""
    target = condition(raw, "DisruptionTarget")
    return text(target, "message") or text(target, "reason") or "it was disrupted"


def _containers(raw: Raw) -> tuple[ContainerView, ...]:
    states = {
        each.get("name"): each
        for field in ("initContainerStatuses", "containerStatuses")
        for each in parts(raw, "status", field)
        if isinstance(each.get("name"), str)
    }
    planned = [
        *((container, _kind(container)) for container in parts(raw, "spec", "initContainers")),
        *((container, ContainerKind.MAIN) for container in parts(raw, "spec", "containers")),
    ]
    return tuple(_container(container, kind, states) for container, kind in planned)


def _kind(planned: dict[str, Any]) -> ContainerKind:
    return ContainerKind.SIDECAR if planned.get("restartPolicy") == "Always" else ContainerKind.INIT


def _container(planned: dict[str, Any], kind: ContainerKind, states: dict[Any, Any]) -> ContainerView:
    name = text(planned, "name", 63)
    status = states.get(name, {})
    running, waiting = part(status, "state", "running"), part(status, "state", "waiting")
    ended = part(status, "state", "terminated") or part(status, "lastState", "terminated")
    started_at = time(running, "startedAt")
    return ContainerView(
        name=name,
        kind=kind,
        image=text(planned, "image", 512),
        running_since=started_at,
        started=started_at is not None and status.get("started") is True,
        waiting=text(waiting, "reason", 60),
        waiting_message=text(waiting, "message"),
        exit=_exit(ended) if ended else None,
        restarts=count(status, "restartCount"),
        memory_limit=text(part(planned, "resources", "limits"), "memory", 32),
    )


def _exit(ended: dict[str, Any]) -> ContainerExit:
    message = ended.get("message")
    return ContainerExit(
        code=count(ended, "exitCode"),
        reason=text(ended, "reason", 60),
        message=message[:MOST_MESSAGE] if isinstance(message, str) else "",
        at=time(ended, "finishedAt"),
    )
