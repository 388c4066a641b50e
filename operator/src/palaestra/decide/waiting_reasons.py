"""Checks for a waiting replica: the status shows the reason, and no pod is ended or counted.

The API server, the scheduler and the kubelet retry by themselves. `palaestra.decide.replica_policy` has the
order of these checks.
"""

import re
from dataclasses import replace

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.clocks import Wait
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.pod_end import (
    full_volume,
    how_it_failed,
    killed_for_memory,
    kills_of,
    limit_of,
    mark_of,
    storage_eviction,
)
from palaestra.decide.replica_context import Finding, ReplicaContext, after, first_waiting, found, next_pod
from palaestra.decide.restart_counts import exit_code, failed_by_itself
from palaestra.decide.suspend import ended_by_suspension
from palaestra.observe.models import ContainerView, PodView
from palaestra.plan.job import GIVEN_UP
from palaestra.plan.replica import INSTALL_SIDECAR, ROS_MASTER, SIMULATOR_PREFIX, TRAINER
from palaestra_protocol.pod.status import SimulatorStatus

LOST_AFTER_S = 30  # seconds from the end of a deleted pod's grace period until its node counts as lost
CRASHES = 3  # crashes of one sidecar after which the status reports a crash loop
PULLING = frozenset(
    {"ErrImagePull", "ImagePullBackOff", "InvalidImageName", "ErrImageNeverPull", "ImageInspectError",
     "RegistryUnavailable", "SignatureValidationFailed"}
)  # fmt: skip
MAKING = frozenset(
    {"CreateContainerConfigError", "CreateContainerError", "RunContainerError", "PreStartHookError",
     "PostStartHookError"}
)  # fmt: skip

# These expressions match the messages of Kubernetes' admission plugins ResourceQuota and LimitRanger.
_UNSPECIFIED = re.compile(r"must specify (?P<containers>.+)$")
_NAMES = re.compile(r"for: (?P<names>[a-z0-9,-]+)")
_SIZES = re.compile(r"\b(?:usage|ratio) per (?:Container|Pod) is ")

_EVERY = "spec.rosMaster.resources, spec.simulators[].resources and spec.trainer.resources"


def objects_refused(situation: ReplicaContext) -> Finding | None:
    """The API server refuses to create an object of the replica; no event in the cluster reports this."""
    if situation.seen.job is not None or not situation.seen.denied or situation.pod is not None:
        return None
    phase = Phase.SUSPENDED if situation.job.spec.suspend else Phase.PENDING
    return Finding(explanation=_not_admitted(situation.seen.denied), phase=phase)


def name_taken(situation: ReplicaContext) -> Finding | None:
    """A Job of another owner has the name that the replica's Job needs."""
    obstacle = situation.seen.obstacle
    if situation.seen.job is not None or obstacle is None:
        return None
    deleting = " and is being deleted" if obstacle.deleting else ""
    return found(Reason.NAME_TAKEN, name=obstacle.name, deleting=deleting)


def old_pod_holds_claim(situation: ReplicaContext) -> Finding | None:
    """A pod of an earlier TrainingJob of the same name may still write to the job's `existingClaim`."""
    old = next(iter(situation.seen.former), None)
    if situation.seen.job is not None or old is None:
        return None
    claim, node = situation.job.spec.storage.existing_claim, old.node or "unknown"
    return found(Reason.OLD_POD_TERMINATING, pod=old.name, claim=claim, node=node)


def pods_refused(situation: ReplicaContext) -> Finding | None:
    """The API server refuses to create the pod; only events of the Job have the reason."""
    refused = situation.seen.refused
    words = situation.seen.denied or (refused.message if refused is not None else "")
    if situation.pod is not None or not words:
        return None
    return Finding(explanation=_not_admitted(words))


def _not_admitted(words: str) -> Explanation:
    """Return the reason with the API server's message, and the fields of the job that a person must set."""
    return explain(Reason.PODS_REFUSED, words=words, remedy=_remedy_of(words))


def node_lost(situation: ReplicaContext) -> Finding | None:
    """A deleted pod still exists 30 seconds after the end of its grace period."""
    pod = situation.pod
    if pod is None or pod.gone_by is None:
        return None
    why = explain(Reason.NODE_LOST, pod=pod.name, node=pod.node, seconds=LOST_AFTER_S)
    wait = Wait(key=("gone", pod.uid), seconds=pod.grace_s + LOST_AFTER_S)
    # The node is lost, but its last report says that the pod runs. So the phase is set here.
    return replace(after(situation, wait, why), phase=Phase.PENDING)


def unschedulable(situation: ReplicaContext) -> Finding | None:
    """The scheduler has not found a node for the pod."""
    if situation.pod is None or not situation.pod.unschedulable:
        return None
    return found(Reason.UNSCHEDULABLE, pod=situation.pod.name, words=situation.pod.unschedulable)


def volume_not_mounted(situation: ReplicaContext) -> Finding | None:
    """The pod has a node, but a volume is not mounted; only events of the pod have the reason."""
    if situation.pod is None or not situation.seen.unmounted:
        return None
    return found(Reason.VOLUME_NOT_MOUNTED, pod=situation.pod.name, words=situation.seen.unmounted)


def image_does_not_come(situation: ReplicaContext) -> Finding | None:
    """An image cannot be pulled; the kubelet retries the pull."""
    stuck = first_waiting(situation.pod, PULLING)
    return None if stuck is None else of_image(stuck)


def container_refused(situation: ReplicaContext) -> Finding | None:
    """The node cannot create a container; the kubelet retries the creation."""
    stuck = first_waiting(situation.pod, MAKING)
    if stuck is None:
        return None
    words = stuck.waiting_message or stuck.waiting
    return found(Reason.CONTAINER_REFUSED, container=stuck.name, words=words)


def sidecar_out_of_memory(situation: ReplicaContext) -> Finding | None:
    """A sidecar ran out of memory and was killed; the kubelet restarts the sidecar."""
    stuck = next(
        (each for each in crashing(situation.pod) if each.simulates and killed_for_memory(each)), None
    )
    return None if stuck is None else Finding(explanation=of_crash(situation, stuck))


def sidecar_crash_loops(situation: ReplicaContext) -> Finding | None:
    """A sidecar crashes repeatedly; the kubelet restarts the sidecar."""
    looping = next(
        (container for container in crashing(situation.pod) if container.restarts >= CRASHES), None
    )
    return None if looping is None else Finding(explanation=of_crash(situation, looping))


def simulator_not_up(situation: ReplicaContext) -> Finding | None:
    """A simulator is slow to start; the trainer fails when the simulator's restart budget is spent."""
    polled = situation.seen.polled
    if situation.pod is None or polled is None or situation.trains or not situation.fresh:
        return None
    up = {sidecar.name: sidecar for sidecar in situation.pod.sidecars if sidecar.running_since is not None}
    states = (
        (simulator, up.get(f"{SIMULATOR_PREFIX}{simulator.name}"))
        for simulator in polled.status.simulators
        if simulator.state != "ready"
    )
    late = [
        _not_up(situation, situation.pod, state, sidecar) for state, sidecar in states if sidecar is not None
    ]
    return min(late, key=lambda finding: finding.left_s, default=None)


def pod_filled_its_storage(situation: ReplicaContext) -> Finding | None:
    """The newest pod was evicted because it wrote too much data, and the next pod does not exist yet."""
    why = None if situation.seen.pod is None else storage_eviction(situation.seen.pod)
    return None if why is None else Finding(explanation=why)


def pod_was_taken(situation: ReplicaContext) -> Finding | None:
    """The newest pod was disrupted or interrupted, and the next pod does not exist yet."""
    pod = situation.seen.pod
    if pod is None or pod.phase != "Failed" or failed_by_itself(pod):
        return None
    if (mark := mark_of(situation, pod)) is not None:
        return Finding(explanation=mark)
    if ended_by_suspension(situation.seen, pod):  # the Job was resumed and will create the next pod
        return None
    if pod.disruption or pod.gone_by is not None:
        words = pod.disruption or "it was deleted"
        return found(Reason.DISRUPTED, pod=pod.name, words=words, next_pod=next_pod(situation))
    how = how_it_failed(situation, pod)
    return found(Reason.INTERRUPTED, pod=pod.name, how=how, next_pod=next_pod(situation))


def volume_is_full(situation: ReplicaContext) -> Finding | None:
    """The newest pod could not write to its full volume; the Job will create another pod."""
    pod = situation.seen.pod
    if pod is None or not failed_by_itself(pod) or no_other_comes(situation, pod):
        return None
    why = full_volume(situation.seen.termination)
    return None if why is None else Finding(explanation=why)


def pod_failed(situation: ReplicaContext) -> Finding | None:
    """The newest pod failed; the Job will create another pod."""
    pod = situation.seen.pod
    if pod is None or not failed_by_itself(pod) or no_other_comes(situation, pod):
        return None
    how = how_it_failed(situation, pod)
    return found(Reason.RETRYING, pod=pod.name, how=how, next_pod=next_pod(situation))


def no_other_comes(situation: ReplicaContext, pod: PodView) -> bool:
    """Return whether a failed pod is the last pod, because its Job is about to fail."""
    booked = situation.seen.job.failures if situation.seen.job is not None else 0
    failures = max(
        booked, situation.counted.restarts.trainer + 1
    )  # the Job may not have counted the newest pod yet
    return failures > situation.job.spec.backoff_limit or exit_code(pod) in GIVEN_UP


def of_image(stuck: ContainerView) -> Finding:
    """Return the finding about a container whose image cannot be pulled."""
    words = stuck.waiting_message or stuck.waiting
    return found(Reason.IMAGE_PULL, container=stuck.name, image=stuck.image, words=words)


def _not_up(
    situation: ReplicaContext, pod: PodView, simulator: SimulatorStatus, sidecar: ContainerView
) -> Finding:
    seconds = situation.start_deadline_s(sidecar.name)
    fault = f": {simulator.last_fault}" if simulator.last_fault else ""
    what = f"{sidecar.name} is not up within {seconds} s of its container's start{fault}"
    wait = Wait(key=("start", pod.uid, sidecar.name, str(sidecar.restarts)), seconds=seconds)
    return after(situation, wait, explain(Reason.SIMULATOR_START_DEADLINE, what=what))


def crashing(pod: PodView | None) -> tuple[ContainerView, ...]:
    """Return the sidecars that have ended and do not run now."""
    sidecars = pod.sidecars if pod is not None else ()
    return tuple(
        sidecar for sidecar in sidecars if sidecar.running_since is None and sidecar.exit is not None
    )


def of_crash(situation: ReplicaContext, container: ContainerView) -> Explanation:
    """Return the reason for a sidecar that crashed."""
    if container.simulates and killed_for_memory(container):
        times, limit = kills_of(situation, container.name), limit_of(container.memory_limit)
        return explain(Reason.SIMULATOR_OUT_OF_MEMORY, container=container.name, limit=limit, times=times)
    times = max(container.restarts, 1)
    code = container.exit.code if container.exit is not None else "unknown"
    return explain(Reason.SIDECAR_CRASH_LOOP, container=container.name, times=times, how=f"exit code {code}")


def _remedy_of(words: str) -> str:
    """Return the clause that names the fields to set, for the end of a message; "" if no field helps.

    Fields help if a quota on limits or a LimitRange refused the pod. The API server's message names
    containers, but a person sets fields. The fields for the ROS master's container and for `install-sidecar`
    have other names.
    """
    if (unspecified := _UNSPECIFIED.search(words)) is not None:
        names = ",".join(_NAMES.findall(unspecified["containers"])).split(",")
        fields = " and ".join(sorted({field for name in names if (field := _field(name))}))
    else:
        fields = _EVERY if _SIZES.search(words) is not None else ""
    return f"; set {fields} in a new job, or jobs.resources in the chart for all jobs" if fields else ""


def _field(container: str) -> str:
    """Return the field with the resources of a container; "" if a webhook has added the container."""
    if container == TRAINER:
        return "spec.trainer.resources"
    if container in {ROS_MASTER, INSTALL_SIDECAR}:
        return "spec.rosMaster.resources"
    return "spec.simulators[].resources" if container.startswith(SIMULATOR_PREFIX) else ""
