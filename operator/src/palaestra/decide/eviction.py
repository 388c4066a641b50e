"""Checks for pods that the kubelet cannot repair and does not end: the operator evicts and counts them.

An eviction gives the pod the condition DisruptionTarget, so its Job counts no failure. Before the eviction,
the operator counts the pod in an annotation of the Job, which is called the mark. If the operator is killed
after the mark is written and before the eviction, it restarts, finds the mark of a running pod, and evicts
that pod.

A trainer that ends because a probe failed exits with 75, and its Job does not count this exit code either.
The operator counts that pod in the mark too. The pod has already ended, so no eviction is needed.

A service mesh or an agent may add a container to the pod. Then the pod may not end, or may end as failed,
although the trainer succeeded. The operator waits a minute for these foreign containers and then ends the
pod.
"""

from dataclasses import replace

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.attempt_end import of_pod, why
from palaestra.decide.clocks import Wait
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.pod_end import mark_of, probe_failed
from palaestra.decide.progress import standstill
from palaestra.decide.replica_context import Finding, ReplicaContext, after, found
from palaestra.decide.restart_counts import exit_code, failed_by_itself
from palaestra.observe.models import PodView
from palaestra.observe.pods import dropped
from palaestra.plan.job import GIVEN_UP
from palaestra_protocol.pod.status import ExitCode

STALL_GRACE_S = 120  # seconds in which the trainer's own watchdog should end the trainer
# Seconds after which the operator assumes that the kubelet will not start the trainer. The start normally
# takes seconds, because the ROS master has the same image, which the node has already pulled.
FORGOTTEN_S = 300
# Seconds for which foreign containers may keep the pod alive after the trainer's end. A proxy normally ends
# sooner than that.
OUTLIVED_S = 60


def marked(situation: ReplicaContext) -> Finding | None:
    """An annotation of the Job marks the pod for replacement, and the pod still runs."""
    if situation.pod is None or situation.pod.gone_by is not None:
        return None
    mark = mark_of(situation, situation.pod)
    return None if mark is None else Finding(explanation=mark)


def restart_policy_dropped(situation: ReplicaContext) -> Finding | None:
    """The pod's sidecars have lost their `restartPolicy`, so they never end and the trainer never starts."""
    pod = situation.pod
    names = dropped(pod) if pod is not None else ()
    if pod is None or not names or pod.gone_by is not None:
        return None
    return found(Reason.RESTART_POLICY_DROPPED, pod=pod.name, containers=", ".join(names))


def trainer_never_started(situation: ReplicaContext) -> Finding | None:
    """All sidecars run, but the kubelet has not started the trainer for five minutes."""
    pod = situation.pod
    if pod is None or pod.trainer is None or not pod.sidecars or pod.gone_by is not None:
        return None
    up = all(sidecar.running_since and sidecar.started for sidecar in pod.sidecars)
    if not up or pod.trainer.waiting != "PodInitializing":
        return None
    reason = explain(Reason.TRAINER_NOT_STARTED, pod=pod.name, seconds=FORGOTTEN_S)
    return after(situation, Wait(key=("trainer", pod.uid), seconds=FORGOTTEN_S), reason)


def stalled(situation: ReplicaContext) -> Finding | None:
    """The trainer responds, but its step count stays the same, and its own watchdog has not acted."""
    wait = standstill(situation)
    if wait is None or situation.pod is None or situation.pod.gone_by is not None or not situation.fresh:
        return None
    seconds = situation.job.spec.stall_deadline_seconds
    what = f"its step count has not changed for more than {seconds} s"
    return after(
        situation, replace(wait, seconds=seconds + STALL_GRACE_S), explain(Reason.STALLED, what=what)
    )


def ended_by_probe(situation: ReplicaContext) -> Finding | None:
    """The kubelet ended the trainer because a probe failed; the Job does not count this end."""
    pod = situation.seen.pod
    if pod is None or not pod.ended or not situation.seen.probe:
        return None
    if failed_by_itself(pod) or mark_of(situation, pod) is not None:
        return None
    return Finding(explanation=probe_failed(situation, pod))


def replaced_too_often(situation: ReplicaContext) -> Finding | None:
    """A pod must be replaced, but `backoffLimit` allows no further replacement."""
    job = situation.seen.job
    times = job.replaced.times if job is not None and job.replaced is not None else 0
    if situation.suspended or marked(situation) is not None or times < situation.job.spec.backoff_limit:
        return None
    return min(situation.causes, key=lambda cause: cause.left_s, default=None)


def kept_alive(situation: ReplicaContext) -> Finding | None:
    """The trainer has ended, but foreign containers keep its pod alive."""
    pod = _outlived(situation)
    if pod is None:
        return None
    names = ", ".join(pod.keeping)
    reason = explain(Reason.KEPT_ALIVE, pod=pod.name, containers=names, seconds=OUTLIVED_S)
    return Finding(explanation=reason, phase=Phase.RUNNING)


def trainer_is_done(situation: ReplicaContext) -> Finding | None:
    """The trainer has ended for good, and foreign containers keep its pod alive or made the pod fail."""
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
    """The trainer has ended and must be retried, but foreign containers keep its pod alive."""
    pod = _outlived(situation)
    if pod is None or exit_code(pod) in {ExitCode.DONE, *GIVEN_UP}:
        return None
    return _overdue(situation, pod)


def _outlived(situation: ReplicaContext) -> PodView | None:
    """Return the pod if only foreign containers keep it alive and it is not being deleted; else None."""
    pod = situation.pod if situation.seen.job is not None else None
    if pod is None or pod.gone_by is not None or exit_code(pod) is None or not pod.keeping:
        return None
    return pod


def _overdue(situation: ReplicaContext, pod: PodView) -> Finding:
    return after(situation, Wait(key=("outlived", pod.uid), seconds=OUTLIVED_S), _why(situation, pod))


def _why(situation: ReplicaContext, pod: PodView) -> Explanation:
    return why(of_pod(situation, pod, situation.counted.attempt))
