"""Sort the objects of a job by replica, and convert the objects to values."""

import re
from collections.abc import Collection, Iterable, Iterator
from datetime import datetime
from typing import Any

from palaestra.api import TrainingJob
from palaestra.api.text import one_line
from palaestra.observe.jobs import MOST_NAME, job_view
from palaestra.observe.json_access import MOST_TEXT, count, owners, part, text, time
from palaestra.observe.models import (
    CreateFailure,
    ForeignJob,
    JobView,
    Objects,
    Observed,
    PodView,
    Raw,
    ReplicaObserved,
)
from palaestra.observe.pods import BEGINNING, pod_view
from palaestra.plan.replica import REPLICA_LABEL, TRAINER, UID_LABEL
from palaestra_protocol.pod.status import ProtocolError, Termination

# Reasons of events from a kubelet, and from the attach-detach controller.
UNMOUNTED = frozenset({"FailedMount", "FailedAttachVolume"})
KILLING = "Killing"  # reason of a kubelet's event; its message explains why the kubelet ends a container
_PROBE = re.compile(rf"Container {TRAINER} failed (liveness|startup) probe\b")


def observe(job: TrainingJob, objects: Objects) -> Observed:
    """Return the observation of the job from the untrusted `objects`."""
    return Observed(
        replicas=tuple(_replica(job, index, objects) for index in range(job.spec.replicas)),
        present=frozenset(
            (kind, text(part(raw, "metadata"), "name", 253))
            for kind, group in (
                ("ConfigMap", objects.config_maps),
                ("PersistentVolumeClaim", objects.claims),
                ("NetworkPolicy", objects.policies),
            )
            for raw in group
            if kind == "PersistentVolumeClaim" or job.metadata.uid in owners(raw)
        ),
        edited=tuple(_edited(job, objects)),
    )


def _edited(job: TrainingJob, objects: Objects) -> Iterator[tuple[str, int]]:
    """Yield name and generation of each changed network policy of the job; its generation is above 1."""
    for raw in objects.policies:
        metadata = part(raw, "metadata")
        generation = count(metadata, "generation")
        if generation > 1 and job.metadata.uid in owners(raw):
            yield text(metadata, "name", 253), generation


def _replica(job: TrainingJob, index: int, objects: Objects) -> ReplicaObserved:
    name = f"{job.metadata.name}-{index}"
    named = [raw for raw in objects.jobs if part(raw, "metadata").get("name") == name]
    ours = next((job_view(raw) for raw in named if job.metadata.uid in owners(raw)), None)
    pods, others = _pods(job, index, objects, ours)
    newest = pods[-1] if pods else None
    return ReplicaObserved(
        index=index,
        job=ours,
        obstacle=next((_obstacle(raw, name) for raw in named if job.metadata.uid not in owners(raw)), None),
        pods=pods,
        in_the_way=tuple(other.name for other in others if not other.ended),
        former=tuple(_former(job, index, objects)),
        polled=objects.polled.get(newest.uid) if newest and not newest.ended else None,
        terminations={pod.uid: word for pod in pods if (word := _last_word(pod)) is not None},
        refused=_refused(ours, newest, objects) if ours else None,
        denied=one_line(objects.denied.get(index) or objects.denied.get(None) or "", MOST_TEXT),
        unmounted=_unmounted(newest, objects) if newest else "",
        probe=_probe(newest, objects) if newest else "",
        unadmitted=objects.unadmitted.get(ours.uid) if ours else None,
        unasked=not objects.unasked.isdisjoint({ours.uid if ours else "", newest.uid if newest else ""}),
        switcher=one_line(objects.switchers.get(ours.uid) or "", MOST_NAME) if ours else "",
    )


def _obstacle(raw: Raw, name: str) -> ForeignJob:
    return ForeignJob(name=name, deleting="deletionTimestamp" in part(raw, "metadata"))


def _pods(
    job: TrainingJob, index: int, objects: Objects, ours: JobView | None
) -> tuple[tuple[PodView, ...], tuple[PodView, ...]]:
    """Return the pods of a replica, oldest first, and all other pods with the replica's labels.

    A user who can create pods can give them the operator's labels. So a pod belongs to the replica only if
    the replica's Job owns the pod, or if the status names it as a pod of an earlier Job.
    """
    known = {
        replica.pod.uid
        for replica in job.status.replicas
        if replica.index == index and replica.pod is not None
    }
    found: dict[str, PodView] = {}
    others: dict[str, PodView] = {}
    for raw in objects.pods:
        labels = part(raw, "metadata", "labels")
        if labels.get(UID_LABEL) == job.metadata.uid and labels.get(REPLICA_LABEL) == str(index):
            view = pod_view(raw)
            made = view.uid in known or (ours is not None and ours.uid in owners(raw))
            (found if made else others)[view.uid] = view
    found.pop("", None)
    in_order = sorted(found.values(), key=lambda pod: (pod.created, not pod.ended, pod.name))
    return tuple(in_order), tuple(others.values())


def _former(job: TrainingJob, index: int, objects: Objects) -> Iterator[PodView]:
    """Yield the pods of an earlier TrainingJob of this name that may still write to a replica's claim.

    A claim that the operator created for the earlier job has that job's uid in its name. So the two jobs can
    share only an `existingClaim`.
    """
    shared = job.spec.storage.existing_claim
    if shared is None:
        return
    for raw in objects.pods:
        labels = part(raw, "metadata", "labels")
        if labels.get(UID_LABEL) != job.metadata.uid and labels.get(REPLICA_LABEL) == str(index):
            view = pod_view(raw)
            if shared in view.claims and not view.ended:
                yield view


def _last_word(pod: PodView) -> Termination | None:
    """Return the trainer's termination message; None if the pod wrote no valid message."""
    trainer = pod.trainer
    if trainer is None or trainer.exit is None:
        return None
    try:
        return Termination.from_message(trainer.exit.message)
    except ProtocolError:
        return None


def _refused(job: JobView, newest: PodView | None, objects: Objects) -> CreateFailure | None:
    """Return the last refusal of a pod, unless a pod was created after it."""
    last = _last_event(objects, job.uid, {"FailedCreate"})
    if last is None or (newest is not None and newest.created >= _when(last)):
        return None
    return CreateFailure(message=text(last, "message"), at=_when(last))


def _unmounted(newest: PodView, objects: Objects) -> str:
    """Return the reason for a pod's missing volumes; "" if all are mounted, or no event has a reason."""
    waits = newest.phase == "Pending" and not newest.mounted
    last = _last_event(objects, newest.uid, UNMOUNTED) if waits else None
    return text(last, "message")


def _probe(newest: PodView, objects: Objects) -> str:
    """Return the failed probe for which the kubelet ended a pod's trainer; "" without such an event."""
    last = _last_event(objects, newest.uid, {KILLING})
    failed = _PROBE.match(text(last, "message")) if last is not None else None
    return failed[1] if failed is not None else ""


def last_blocking_event(events: Iterable[Raw], uid: str) -> dict[str, Any] | None:
    """Return the last event that explains an incomplete object, with only the fields that `observe` reads."""
    found = (raw for raw in events if _is_read(raw))
    last = max(found, key=_when, default=None)
    if last is None:
        return None
    at = _when(last).isoformat()
    words = {"reason": text(last, "reason"), "message": text(last, "message"), "lastTimestamp": at}
    return {"involvedObject": {"uid": uid}, **words}


def _is_read(event: Raw) -> bool:
    """Return whether this module reads an event of this reason and message.

    A kubelet also writes `Killing` events about the other containers, which it ends after the trainer.
    """
    reason = text(event, "reason")
    return reason in {"FailedCreate", *UNMOUNTED} or (
        reason == KILLING and _PROBE.match(text(event, "message")) is not None
    )


def _last_event(objects: Objects, uid: str, reasons: Collection[str]) -> Raw | None:
    """Return the last event of one of these reasons about the object with this uid."""
    found = (
        raw
        for raw in objects.events
        if text(raw, "reason") in reasons and part(raw, "involvedObject").get("uid") == uid
    )
    return max(found, key=_when, default=None)


def _when(event: Raw) -> datetime:
    series = time(part(event, "series"), "lastObservedTime")
    return series or time(event, "lastTimestamp") or time(event, "eventTime") or BEGINNING
