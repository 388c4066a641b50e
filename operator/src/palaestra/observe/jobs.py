"""The batch/v1 Job of a replica, from the API server's JSON."""

import re

from palaestra.observe.json_access import condition, count, holds, part, parts, text, time
from palaestra.observe.models import JobEnd, JobView, Raw, Replaced, Suspended
from palaestra.plan.job import QUEUE_LABEL, SUSPEND_SET

MOST_NAME = 128  # the API server's limit for a field manager's name
# The fields of a Job's spec, besides `suspend`, that other clients can change.
SETTINGS = ("parallelism", "backoffLimit", "activeDeadlineSeconds", "ttlSecondsAfterFinished")
STOPPED = "palaestra.dev/stopped"  # annotation of a Job: "<reason>: <message>"
# Annotation of a Job: "<uid of the pod> lived" or "<uid of the pod> ended".
SUSPENDED = "palaestra.dev/suspended"
REPLACED = "palaestra.dev/replaced"  # annotation of a Job: "<times> <uid of the pod> <reason>: <message>"
_REPLACED = re.compile(r"(\d{1,9}) (\S{1,253}) (\w{1,60}): (.{0,1024})")
_SUSPENDED = re.compile(r"(\S{1,253}) (lived|ended)")

# Kubernetes sets the last two conditions before the last pod has ended. The operator needs these conditions,
# because a pod on a lost node never ends.
_ENDS = (
    ("Complete", JobEnd.COMPLETE),
    ("Failed", JobEnd.FAILED),
    ("SuccessCriteriaMet", JobEnd.COMPLETE),
    ("FailureTarget", JobEnd.FAILED),
)


def job_view(raw: Raw) -> JobView:
    """Return the view of a Job; absent values are empty."""
    metadata, status = part(raw, "metadata"), part(raw, "status")
    named, end = next(((kind, end) for kind, end in _ENDS if holds(raw, kind)), ("", None))
    ending = condition(raw, named)
    suspension = condition(raw, "Suspended")
    turned = {suspension.get("status"): time(suspension, "lastTransitionTime")}
    return JobView(
        name=text(metadata, "name", 253),
        uid=text(metadata, "uid", 253),
        version=text(metadata, "resourceVersion", 253),
        suspended=part(raw, "spec").get("suspend") is True,
        suspend_set=_suspend_set(part(metadata, "annotations")),
        suspension=_suspension(part(metadata, "annotations")),
        paused=turned.get("True"),
        resumed=turned.get("False"),
        stopped=_stopped(part(metadata, "annotations")),
        replaced=_replaced(part(metadata, "annotations")),
        failures=_failures(status),
        end=end,
        end_reason=text(ending, "reason", 60),
        end_message=text(ending, "message"),
        settings={name: count(part(raw, "spec"), name) for name in SETTINGS if name in part(raw, "spec")},
        deleting="deletionTimestamp" in metadata,
        volumes=_volumes(raw),
        queue=text(part(metadata, "labels"), QUEUE_LABEL, 63),
    )


def _stopped(annotations: dict[str, object]) -> tuple[str, str] | None:
    if not isinstance(annotations.get(STOPPED), str):
        return None
    reason, _, message = text(annotations, STOPPED, 1100).partition(": ")
    return reason, message


def _suspend_set(annotations: dict[str, object]) -> bool | None:
    return {"true": True, "false": False}.get(text(annotations, SUSPEND_SET, 10))


def _suspension(annotations: dict[str, object]) -> Suspended | None:
    """Return the mark about the pod of the last suspension; None without a valid mark."""
    mark = _SUSPENDED.fullmatch(text(annotations, SUSPENDED, 300))
    return None if mark is None else Suspended(pod=mark[1], lived=mark[2] == "lived")


def _replaced(annotations: dict[str, object]) -> Replaced | None:
    """Return the mark about the replaced pods; None without a valid mark."""
    mark = _REPLACED.fullmatch(text(annotations, REPLACED, 1400))
    if mark is None:
        return None
    return Replaced(times=int(mark[1]), pod=mark[2], reason=mark[3], message=mark[4])


def _failures(status: dict[str, object]) -> int:
    """Return the number of failed pods, including those that the Job controller has not counted yet."""
    uncounted = part(status, "uncountedTerminatedPods").get("failed")
    return count(status, "failed") + (len(uncounted) if isinstance(uncounted, list) else 0)


def _volumes(raw: Raw) -> frozenset[str]:
    names = (
        text(part(volume, kind), name, 253)
        for volume in parts(raw, "spec", "template", "spec", "volumes")
        for kind, name in (("configMap", "name"), ("persistentVolumeClaim", "claimName"))
    )
    return frozenset(name for name in names if name)


def suspends(raw: Raw) -> str:
    """Return the field manager that last set a Job's `spec.suspend`; "" if the object does not name it."""
    entries = [
        (text(entry, "time"), text(entry, "manager", MOST_NAME))
        for entry in parts(raw, "metadata", "managedFields")
        if "f:suspend" in part(entry, "fieldsV1", "f:spec")
    ]
    return max(entries, default=("", ""))[1]
