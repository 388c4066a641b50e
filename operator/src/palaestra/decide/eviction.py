"""Checks for pods that the kubelet does not repair: the operator evicts them, and counts that.

An eviction gives the pod the condition DisruptionTarget, so its Job counts no failure. The operator counts it
in an annotation of the Job, the mark, before it evicts. If it is killed between the two writes, it finds the
mark of a running pod after its restart, and evicts again.

A trainer that a failed probe interrupted exits with 75, which its Job does not count either. Its pod gets the
mark too; it has ended, so no pod is evicted.
"""

from dataclasses import replace

from palaestra.api.reasons import Reason
from palaestra.decide.clocks import Wait
from palaestra.decide.progress import standstill
from palaestra.decide.remaining_containers import pod_outlives_trainer
from palaestra.decide.replica_context import Check, Finding, ReplicaContext, after, explain, found
from palaestra.decide.restart_counts import failed_by_itself
from palaestra.decide.waiting_reasons import mark_of, probe_failed
from palaestra.observe.pods import dropped

STALL_GRACE_S = 120  # time for the trainer's own watchdog to end it
FORGOTTEN_S = 300  # the trainer starts in seconds: the ROS master has the same image


def marked(situation: ReplicaContext) -> Finding | None:
    """The pod is marked for replacement and still runs."""
    if situation.pod is None or situation.pod.gone_by is not None:
        return None
    mark = mark_of(situation, situation.pod)
    return None if mark is None else Finding(explanation=mark)


def restart_policy_dropped(situation: ReplicaContext) -> Finding | None:
    """Sidecars became ordinary init containers: such a pod never starts its trainer."""
    pod = situation.pod
    names = dropped(pod) if pod is not None else ()
    if pod is None or not names or pod.gone_by is not None:
        return None
    return found(Reason.RESTART_POLICY_DROPPED, pod=pod.name, containers=", ".join(names))


def trainer_never_started(situation: ReplicaContext) -> Finding | None:
    """All sidecars run, but the kubelet does not start the trainer."""
    pod = situation.pod
    if pod is None or pod.trainer is None or not pod.sidecars or pod.gone_by is not None:
        return None
    up = all(sidecar.running_since and sidecar.started for sidecar in pod.sidecars)
    if not up or pod.trainer.waiting != "PodInitializing":
        return None
    reason = explain(Reason.TRAINER_NOT_STARTED, pod=pod.name, seconds=FORGOTTEN_S)
    return after(situation, Wait(key=("trainer", pod.uid), seconds=FORGOTTEN_S), reason)


def stalled(situation: ReplicaContext) -> Finding | None:
    """The trainer responds, its step count does not change, and its watchdog has not ended it."""
    wait = standstill(situation)
    if wait is None or situation.pod is None or situation.pod.gone_by is not None or not situation.fresh:
        return None
    seconds = situation.job.spec.stall_deadline_seconds
    what = f"no step was learned from for more than {seconds} s"
    return after(
        situation, replace(wait, seconds=seconds + STALL_GRACE_S), explain(Reason.STALLED, what=what)
    )


def ended_by_probe(situation: ReplicaContext) -> Finding | None:
    """The kubelet ended the trainer because a probe failed, and its Job does not count that."""
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
    causes = (cause for check in REPLACED if (cause := check(situation)) is not None)
    return min(causes, key=lambda cause: cause.left_s, default=None)


REPLACED: tuple[Check, ...] = (
    restart_policy_dropped,
    trainer_never_started,
    stalled,
    ended_by_probe,
    pod_outlives_trainer,
)
