"""The batch/v1 Job of a replica, which makes its pods, one at a time."""

from collections.abc import Mapping
from typing import Any

from palaestra.plan.replica import TRAINER, Replica
from palaestra_sim.protocol.status import ExitCode

QUEUE_LABEL = "kueue.x-k8s.io/queue-name"
GIVEN_UP = (ExitCode.CONFIGURATION, ExitCode.FAULT_BUDGET, ExitCode.DIVERGED)


def job(replica: Replica, template: Mapping[str, Any]) -> dict[str, Any]:
    """Return the Job; its deadline is the operator's, which does not count suspended time.

    With a queue it is made suspended, and whether it is is Kueue's from then on.
    """
    queue = replica.job.spec.scheduling.queue_name
    metadata = replica.metadata(replica.name)
    if queue is not None:
        metadata["labels"] = {**replica.labels, QUEUE_LABEL: queue}
    return {
        "apiVersion": "batch/v1",
        "kind": "Job",
        "metadata": metadata,
        "spec": {
            "backoffLimit": replica.job.spec.backoff_limit,
            "podReplacementPolicy": "Failed",  # one writer: the old pod is gone before the next
            "podFailurePolicy": {"rules": _failure_rules()},
            "suspend": queue is not None or replica.job.spec.suspend,
            "template": template,
        },
    }


def _failure_rules() -> list[dict[str, Any]]:
    """Return what the end of a pod means, in order; what matches no rule is tried again, counted.

    The trainer is always named: a rule without a name would match the sidecars' exit codes too.
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
