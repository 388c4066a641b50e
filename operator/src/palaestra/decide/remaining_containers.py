"""Checks for a pod whose trainer has ended while foreign containers keep the pod alive.

A service mesh or an agent may add a container to the pod. Then the pod does not end, or ends as failed, even
if the trainer succeeded. The operator waits a minute for these foreign containers and then ends the pod.
"""

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.attempt_end import of_pod, why
from palaestra.decide.clocks import Wait
from palaestra.decide.conditions import Explanation
from palaestra.decide.replica_context import Finding, ReplicaContext, after, explain
from palaestra.decide.restart_counts import exit_code
from palaestra.observe.models import PodView
from palaestra.plan.job import GIVEN_UP
from palaestra_protocol.pod.status import ExitCode

OUTLIVED_S = 60  # a proxy that ends with the main process needs seconds


def kept_alive(situation: ReplicaContext) -> Finding | None:
    """The trainer has ended, and foreign containers keep its pod alive."""
    pod = _outlived(situation)
    if pod is None:
        return None
    names = ", ".join(pod.keeping)
    reason = explain(Reason.KEPT_ALIVE, pod=pod.name, containers=names, seconds=OUTLIVED_S)
    return Finding(explanation=reason, phase=Phase.RUNNING)


def trainer_is_done(situation: ReplicaContext) -> Finding | None:
    """The trainer has ended for good, and foreign containers keep its pod alive or made it fail."""
    pod, job = situation.seen.pod, situation.seen.job
    if pod is None or job is None or job.end is not None:
        return None
    if pod.phase == "Failed" and exit_code(pod) == ExitCode.DONE:
        return Finding(explanation=_why(situation, pod))
    outlived = _outlived(situation)
    if outlived is None or exit_code(outlived) not in {ExitCode.DONE, *GIVEN_UP}:
        return None
    return _overdue(situation, outlived)


def pod_outlives_trainer(situation: ReplicaContext) -> Finding | None:
    """The trainer has ended and must be retried, and foreign containers keep its pod alive."""
    pod = _outlived(situation)
    if pod is None or exit_code(pod) in {ExitCode.DONE, *GIVEN_UP}:
        return None
    return _overdue(situation, pod)


def _outlived(situation: ReplicaContext) -> PodView | None:
    """Return the pod if only foreign containers keep it alive and it is not being deleted."""
    pod = situation.pod if situation.seen.job is not None else None
    if pod is None or pod.gone_by is not None or exit_code(pod) is None or not pod.keeping:
        return None
    return pod


def _overdue(situation: ReplicaContext, pod: PodView) -> Finding:
    return after(situation, Wait(key=("outlived", pod.uid), seconds=OUTLIVED_S), _why(situation, pod))


def _why(situation: ReplicaContext, pod: PodView) -> Explanation:
    return why(of_pod(situation, pod, situation.counted.attempt))
