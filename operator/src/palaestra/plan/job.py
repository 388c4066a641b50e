"""The batch/v1 Job of a replica, which creates its pods, one at a time."""

from collections.abc import Mapping
from typing import Any

from palaestra.plan.replica import TRAINER, Replica
from palaestra_protocol.pod.status import ExitCode

QUEUE_LABEL = "kueue.x-k8s.io/queue-name"
SUSPEND_SET = "palaestra.dev/suspend-set"  # annotation: the `spec.suspend` that the operator last set
GIVEN_UP = (ExitCode.CONFIGURATION, ExitCode.FAULT_BUDGET, ExitCode.DIVERGED)


def job(replica: Replica, template: Mapping[str, Any]) -> dict[str, Any]:
    """Return the Job; the operator enforces the job's deadline, because it does not count suspended time.

    With a queue it is created suspended, and Kueue sets `spec.suspend` from then on. Without a queue an
    annotation holds the operator's value, so that the operator recognizes another client's change and keeps
    it.
    """
    queue, suspend = replica.job.spec.scheduling.queue_name, replica.job.spec.suspend
    metadata = replica.metadata(replica.name)
    if queue is not None:
        metadata["labels"] = {**replica.labels, QUEUE_LABEL: queue}
    else:
        metadata["annotations"] = suspend_set(suspend=suspend)
    return {
        "apiVersion": "batch/v1",
        "kind": "Job",
        "metadata": metadata,
        "spec": {
            "backoffLimit": replica.job.spec.backoff_limit,
            # One writer at a time: the old pod has ended before the next one starts.
            "podReplacementPolicy": "Failed",
            "podFailurePolicy": {"rules": _failure_rules()},
            "suspend": queue is not None or suspend,
            "template": template,
        },
    }


def suspend_set(*, suspend: bool) -> dict[str, str]:
    """Return the annotation of a Job whose `spec.suspend` the operator sets to `suspend`."""
    return {SUSPEND_SET: "true" if suspend else "false"}


def _failure_rules() -> list[dict[str, Any]]:
    """Return the rules for failed pods, in order; a failure without a rule is counted and retried.

    The rules always name the trainer: a rule without a name would match the sidecars' exit codes too.
    """
    disrupted = {"type": "DisruptionTarget", "status": "True"}
    return [
        {"action": "Ignore", "onPodConditions": [disrupted]},
        {"action": "Ignore", "onExitCodes": _trainer_ends_with(ExitCode.INTERRUPTED)},
        {"action": "FailJob", "onExitCodes": _trainer_ends_with(*GIVEN_UP)},
    ]


def _trainer_ends_with(*codes: ExitCode) -> dict[str, Any]:
    return {
        "containerName": TRAINER,
        "operator": "In",
        "values": sorted(int(code) for code in codes),
    }
