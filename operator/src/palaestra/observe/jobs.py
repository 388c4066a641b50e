"""The batch/v1 Job of a replica, as the API server shows it."""

from palaestra.observe.reading import condition, count, holds, part, parts, text, time
from palaestra.observe.views import JobEnd, JobView, Raw
from palaestra.plan.job import QUEUE_LABEL

STOPPED = "palaestra.dev/stopped"  # annotation of a Job: "<reason>: <message>"

# The outcome is certain before the last pod has ended: a pod on a lost node never does.
_ENDS = (
    ("Complete", JobEnd.COMPLETE),
    ("Failed", JobEnd.FAILED),
    ("SuccessCriteriaMet", JobEnd.COMPLETE),
    ("FailureTarget", JobEnd.FAILED),
)


def job_view(raw: Raw) -> JobView:
    """Return the Job; what it does not tell is empty."""
    metadata, status = part(raw, "metadata"), part(raw, "status")
    named, end = next(((kind, end) for kind, end in _ENDS if holds(raw, kind)), ("", None))
    ending = condition(raw, named)
    suspension = condition(raw, "Suspended")
    turned = {suspension.get("status"): time(suspension, "lastTransitionTime")}
    return JobView(
        name=text(metadata, "name", 253),
        uid=text(metadata, "uid", 253),
        suspended=part(raw, "spec").get("suspend") is True,
        paused=turned.get("True"),
        resumed=turned.get("False"),
        stopped=_stopped(part(metadata, "annotations")),
        failures=_failures(status),
        end=end,
        end_reason=text(ending, "reason", 60),
        end_message=text(ending, "message"),
        ended=time(ending, "lastTransitionTime"),
        deleting="deletionTimestamp" in metadata,
        volumes=_volumes(raw),
        queue=text(part(metadata, "labels"), QUEUE_LABEL, 63),
    )


def _stopped(annotations: dict[str, object]) -> tuple[str, str] | None:
    if not isinstance(annotations.get(STOPPED), str):
        return None
    reason, _, message = text(annotations, STOPPED, 1100).partition(": ")
    return reason, message


def _failures(status: dict[str, object]) -> int:
    """Return the pods that failed: those that the Job controller has booked and those that it is about to."""
    uncounted = part(status, "uncountedTerminatedPods").get("failed")
    return count(status, "failed") + (len(uncounted) if isinstance(uncounted, list) else 0)


def _volumes(raw: Raw) -> frozenset[str]:
    names = (
        text(part(volume, kind), name, 253)
        for volume in parts(raw, "spec", "template", "spec", "volumes")
        for kind, name in (("configMap", "name"), ("persistentVolumeClaim", "claimName"))
    )
    return frozenset(name for name in names if name)
