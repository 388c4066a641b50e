"""What is wrong with a replica that has not ended: shown at once, fatal only by a deadline.

The order is the policy: what keeps pods from being made comes before what keeps them from starting, and
the cause before its symptom.
"""

from datetime import datetime

from palaestra.api.reasons import Reason
from palaestra.decide.conditions import Told
from palaestra.decide.counting import exit_code, failed_by_itself
from palaestra.decide.moments import after, seconds_between
from palaestra.decide.situation import Situation, TroubleCheck, first_waiting, told
from palaestra.observe.pods import dropped
from palaestra.observe.views import ContainerKind, ContainerView, PodView
from palaestra.plan.job import GIVEN_UP

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
OUT_OF_MEMORY = "OOMKilled"


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


def sidecar_out_of_memory(it: Situation) -> Told | None:
    """A sidecar was killed for its memory and is on its way back."""
    stuck = next((each for each in crashing(it.pod) if killed_for_memory(each)), None)
    return None if stuck is None else of_crash(stuck)


def sidecar_crash_loops(it: Situation) -> Told | None:
    """A sidecar does not stay up; Kubernetes never fails a pod for that."""
    looping = next((each for each in crashing(it.pod) if each.restarts >= CRASHES), None)
    return None if looping is None else of_crash(looping)


def pod_filled_its_storage(it: Situation) -> Told | None:
    """The newest pod wrote more than it may and no other is there yet."""
    return None if it.seen.pod is None else storage_eviction(it.seen.pod)


def pod_was_taken(it: Situation) -> Told | None:
    """The newest pod was interrupted and no other is there yet."""
    pod = it.seen.pod
    if pod is None or pod.phase != "Failed" or failed_by_itself(pod):
        return None
    words = pod.disruption or pod.message or _exit_words(pod)
    return told(Reason.INTERRUPTED, pod=pod.name, words=f" ({words})" if words else "")


def _exit_words(pod: PodView) -> str:
    code = exit_code(pod)
    return "" if code is None else f"exit code {code}"


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
    image_does_not_come,
    container_refused,
    sidecar_out_of_memory,
    sidecar_crash_loops,
    pod_filled_its_storage,
    pod_was_taken,
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


def killed_for_memory(container: ContainerView) -> bool:
    """Return whether a container's last end was the kernel's, for its memory."""
    return container.exit is not None and container.exit.reason == OUT_OF_MEMORY


def of_crash(container: ContainerView) -> Told:
    """Return what to say of a sidecar that crashed."""
    times = max(container.restarts, 1)
    if killed_for_memory(container):
        return told(Reason.SIMULATOR_OUT_OF_MEMORY, container=container.name, times=times)
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
    if code is None and (before := _failed_before(pod)) is not None:
        return before
    words = _last_line(trainer) or pod.message or pod.reason or "no word from the trainer"
    return f"exit code {code}, {words}" if code is not None else words


def _failed_before(pod: PodView) -> str | None:
    """Return how a container failed that has to end well before the others start; None: none has."""
    for each in pod.containers:
        if each.kind is ContainerKind.INIT and each.exit is not None and each.exit.code:
            line = _last_line(each) or each.exit.reason or "no word"
            return f"container {each.name}: exit code {each.exit.code}, {line}"
    return None


def _last_line(container: ContainerView | None) -> str:
    """Return the last line of what a container left."""
    log = container.exit.message if container is not None and container.exit is not None else ""
    return next(iter(log.strip().splitlines()[-1:]), "")
