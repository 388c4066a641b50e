"""What is wrong with a replica that has not ended: shown at once, fatal only by a deadline.

The order is the policy: what keeps pods from being made comes before what keeps them from starting, and
the cause before its symptom.
"""

from datetime import datetime

from palaestra.api.reasons import Reason
from palaestra.decide.conditions import Told
from palaestra.decide.counting import exit_code, failed_by_itself
from palaestra.decide.memory import killed_for_memory, kills_of, limit_of
from palaestra.decide.moments import after, seconds_between
from palaestra.decide.situation import Situation, TroubleCheck, first_waiting, told
from palaestra.observe.pods import dropped
from palaestra.observe.views import ContainerKind, ContainerView, PodView
from palaestra.plan.job import GIVEN_UP
from palaestra_sim.protocol.status import Termination

LOST_AFTER_S = 30  # past the moment at which a deleted pod was to be gone
CRASHES = 3  # of one sidecar, before they are called a loop
PULLING = frozenset(
    {"ErrImagePull", "ImagePullBackOff", "InvalidImageName", "ErrImageNeverPull", "ImageInspectError",
     "RegistryUnavailable", "SignatureValidationFailed"}
)  # fmt: skip
MAKING = frozenset(
    {"CreateContainerConfigError", "CreateContainerError", "RunContainerError", "PreStartHookError",
     "PostStartHookError"}
)  # fmt: skip
FULL = ("StorageFull", "DiskFull")  # how a last word begins; the second in older releases


def name_taken(it: Situation) -> Told | None:
    """Another Job has the replica's name."""
    obstacle = it.seen.obstacle
    if it.seen.job is not None or obstacle is None:
        return None
    return told(
        Reason.NAME_TAKEN, name=obstacle.name, deleting=" and is being deleted" if obstacle.deleting else ""
    )


def pods_refused(it: Situation) -> Told | None:
    """The API server makes no pod; only the Job's events tell."""
    refused = it.seen.refused
    if refused is None or it.pod is not None:
        return None
    return told(Reason.PODS_REFUSED, words=refused.message)


def objects_refused(it: Situation) -> Told | None:
    """The API server makes no object of ours; what it said is told by nobody else."""
    if not it.seen.denied or it.pod is not None:
        return None
    return told(Reason.PODS_REFUSED, words=it.seen.denied)


def node_lost(it: Situation) -> Told | None:
    """A pod is not gone long after it was to be."""
    pod, at = it.pod, lost_at(it)
    if pod is None or pod.gone_by is None or at is None or it.now < at:
        return None
    return told(Reason.NODE_LOST, pod=pod.name, node=pod.node, seconds=seconds_between(pod.gone_by, it.now))


def restart_policy_dropped(it: Situation) -> Told | None:
    """Sidecars became ordinary init containers, each of which the next waits for."""
    names = dropped(it.pod) if it.pod is not None else ()
    if it.pod is None or not names:
        return None
    return told(Reason.RESTART_POLICY_DROPPED, pod=it.pod.name, containers=", ".join(names))


def unschedulable(it: Situation) -> Told | None:
    """No node takes the pod."""
    if it.pod is None or not it.pod.unschedulable:
        return None
    return told(Reason.UNSCHEDULABLE, pod=it.pod.name, words=it.pod.unschedulable)


def image_does_not_come(it: Situation) -> Told | None:
    """An image is not there, or not for us."""
    stuck = first_waiting(it.pod, PULLING)
    if stuck is None:
        return None
    words = stuck.waiting_message or stuck.waiting
    return told(Reason.IMAGE_PULL, container=stuck.name, image=stuck.image, words=words)


def container_refused(it: Situation) -> Told | None:
    """The node cannot make a container."""
    stuck = first_waiting(it.pod, MAKING)
    if stuck is None:
        return None
    words = stuck.waiting_message or stuck.waiting
    return told(Reason.CONTAINER_REFUSED, container=stuck.name, words=words)


def volume_not_mounted(it: Situation) -> Told | None:
    """The node has the pod, and a volume does not come; only the pod's events tell."""
    if it.pod is None or not it.seen.unmounted:
        return None
    return told(Reason.VOLUME_NOT_MOUNTED, pod=it.pod.name, words=it.seen.unmounted)


def sidecar_out_of_memory(it: Situation) -> Told | None:
    """A sidecar was killed for its memory and is on its way back."""
    stuck = next((each for each in crashing(it.pod) if killed_for_memory(each)), None)
    return None if stuck is None else of_crash(it, stuck)


def sidecar_crash_loops(it: Situation) -> Told | None:
    """A sidecar does not stay up; Kubernetes never fails a pod for that."""
    looping = next((each for each in crashing(it.pod) if each.restarts >= CRASHES), None)
    return None if looping is None else of_crash(it, looping)


def pod_filled_its_storage(it: Situation) -> Told | None:
    """The newest pod wrote more than it may and no other is there yet."""
    return None if it.seen.pod is None else storage_eviction(it.seen.pod)


def pod_was_taken(it: Situation) -> Told | None:
    """The newest pod was interrupted and no other is there yet."""
    pod = it.seen.pod
    if pod is None or pod.phase != "Failed" or failed_by_itself(pod):
        return None
    if pod.disruption or pod.gone_by is not None:
        return told(Reason.DISRUPTED, pod=pod.name, words=pod.disruption or "it was deleted")
    return told(Reason.INTERRUPTED, pod=pod.name, how=how_it_failed(it, pod))


def volume_is_full(it: Situation) -> Told | None:
    """The newest pod could not write to the volume, and another will try."""
    pod = it.seen.pod
    if pod is None or not failed_by_itself(pod) or no_other_comes(it, pod):
        return None
    return full_volume(it.seen.termination)


def pod_failed(it: Situation) -> Told | None:
    """The newest pod failed and another will come."""
    pod = it.seen.pod
    if pod is None or not failed_by_itself(pod) or no_other_comes(it, pod):
        return None
    return told(Reason.RETRYING, pod=pod.name, how=how_it_failed(it, pod))


TROUBLES: tuple[TroubleCheck, ...] = (
    name_taken,
    objects_refused,
    pods_refused,
    node_lost,
    restart_policy_dropped,
    unschedulable,
    volume_not_mounted,
    image_does_not_come,
    container_refused,
    sidecar_out_of_memory,
    sidecar_crash_loops,
    pod_filled_its_storage,
    pod_was_taken,
    volume_is_full,
    pod_failed,
)


def no_other_comes(it: Situation, pod: PodView) -> bool:
    """Return whether a pod that failed is the last: the Job is about to say that it failed, and why."""
    booked = it.seen.job.failures if it.seen.job is not None else 0
    failures = max(booked, it.counted.restarts.trainer + 1)  # the newest may not be booked yet
    return failures > it.job.spec.backoff_limit or exit_code(pod) in GIVEN_UP


def lost_at(it: Situation) -> datetime | None:
    """Return when a pod that was deleted and is still there is called lost."""
    return None if it.pod is None or it.pod.gone_by is None else after(it.pod.gone_by, LOST_AFTER_S)


def crashing(pod: PodView | None) -> tuple[ContainerView, ...]:
    """Return the sidecars that do not run now, though they have before."""
    sidecars = pod.sidecars if pod is not None else ()
    return tuple(each for each in sidecars if each.running_since is None and each.exit is not None)


def storage_eviction(pod: PodView) -> Told | None:
    """Return what to say of a pod that its node evicted for what it wrote; None: it did not."""
    if pod.reason != "Evicted" or "ephemeral" not in pod.message.lower():
        return None
    return told(Reason.EPHEMERAL_STORAGE, pod=pod.name, words=pod.message)


def full_volume(word: Termination | None) -> Told | None:
    """Return what to say of a trainer that could not write to its volume; None: it could."""
    if word is None or not word.reason.startswith(FULL):
        return None
    fact = word.reason.partition(": ")[2].partition("; ")[0]  # its remedy is ours
    return told(Reason.STORAGE_FULL, words=fact or "no space left")


def of_crash(it: Situation, container: ContainerView) -> Told:
    """Return what to say of a sidecar that crashed."""
    if killed_for_memory(container):
        times, limit = kills_of(it, container.name), limit_of(container.memory_limit)
        return told(Reason.SIMULATOR_OUT_OF_MEMORY, container=container.name, limit=limit, times=times)
    times = max(container.restarts, 1)
    code = container.exit.code if container.exit is not None else "unknown"
    return told(Reason.SIDECAR_CRASH_LOOP, container=container.name, times=times, how=f"exit code {code}")


def how_it_failed(it: Situation, pod: PodView) -> str:
    """Return how a pod failed, in the best words that there are."""
    word = it.seen.terminations.get(pod.uid)
    trainer = pod.trainer
    if trainer is not None and killed_for_memory(trainer):
        return "the trainer was killed for its memory"
    code = exit_code(pod)
    if word is not None and word.reason:
        return f"exit code {code}, {word.reason}"
    if code is None and (before := _failed_before(pod)) is not None and before.exit is not None:
        line = _last_line(before) or before.exit.reason or "no word"
        return f"container {before.name}: exit code {before.exit.code}, {line}"
    words = _last_line(trainer) or pod.message or pod.reason or "no word from the trainer"
    return f"exit code {code}, {words}" if code is not None else words


def _failed_before(pod: PodView) -> ContainerView | None:
    """Return the container that failed and has to end well before the others start; None: none has."""
    init = (each for each in pod.containers if each.kind is ContainerKind.INIT)
    return next((each for each in init if each.exit is not None and each.exit.code), None)


def left_by(pod: PodView) -> str:
    """Return the end of the log of a pod's trainer, or of what kept it from starting; "": nothing is left."""
    failed = _failed_before(pod)
    trainer = pod.trainer
    ends = [each.exit for each in (trainer, failed) if each is not None and each.exit is not None]
    return next((end.message for end in ends if end.message), "")


def _last_line(container: ContainerView | None) -> str:
    """Return the last line of what a container left."""
    log = container.exit.message if container is not None and container.exit is not None else ""
    return next(iter(log.strip().splitlines()[-1:]), "")
