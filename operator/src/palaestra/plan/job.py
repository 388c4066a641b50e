"""The batch/v1 Job of a replica; the Job creates the replica's pods, one at a time."""

from collections.abc import Mapping
from typing import Any

from palaestra.plan.replica import TRAINER, Replica
from palaestra_protocol.pod.status import ExitCode

QUEUE_LABEL = "kueue.x-k8s.io/queue-name"
# Annotation: the value of `spec.suspend` that the operator set last.
SUSPEND_SET = "palaestra.dev/suspend-set"
GIVEN_UP = (ExitCode.CONFIGURATION, ExitCode.FAULT_BUDGET, ExitCode.DIVERGED)


def job(replica: Replica, template: Mapping[str, Any]) -> dict[str, Any]:
    """Return the Job; the operator, not the Job, enforces the active deadline of the TrainingJob.

    A Job with a queue is created suspended, and Kueue sets `spec.suspend` from then on. On a Job without a
    queue, an annotation stores the operator's value of `spec.suspend`. So the operator recognizes a change by
    another client, and does not undo this change.
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
            # Only one pod at a time writes to the volume: the next pod starts after the old pod has ended.
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
    """Return the rules for failed pods, in order; a failure that matches no rule is counted and retried.

    The rules name the trainer: a rule without a container's name would match the sidecars' exit codes too.
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
