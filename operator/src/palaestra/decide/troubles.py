"""Checks for a waiting replica: the status shows the reason, and nothing is ended or counted.

The API server, the scheduler and the kubelet retry by themselves. `palaestra.decide.judging` has the order of
these checks.
"""

from dataclasses import replace

from palaestra.api.reasons import Reason
from palaestra.api.status import Phase
from palaestra.decide.conditions import Told
from palaestra.decide.counting import exit_code, failed_by_itself
from palaestra.decide.memory import killed_for_memory, kills_of, limit_of
from palaestra.decide.situation import Finding, Situation, after, first_waiting, found, told
from palaestra.decide.suspending import ended_by_suspension
from palaestra.decide.times import Wait
from palaestra.observe.views import ContainerKind, ContainerView, PodView
from palaestra.plan.job import GIVEN_UP
from palaestra_protocol.pod.status import SimulatorStatus, Termination

LOST_AFTER_S = 30  # after the end of a deleted pod's grace period
CRASHES = 3  # of one sidecar, before they are called a loop
PULLING = frozenset(
    {"ErrImagePull", "ImagePullBackOff", "InvalidImageName", "ErrImageNeverPull", "ImageInspectError",
     "RegistryUnavailable", "SignatureValidationFailed"}
)  # fmt: skip
MAKING = frozenset(
    {"CreateContainerConfigError", "CreateContainerError", "RunContainerError", "PreStartHookError",
     "PostStartHookError"}
)  # fmt: skip
FULL = ("StorageFull", "DiskFull")  # beginnings of a termination message; the second in older releases


def objects_refused(it: Situation) -> Finding | None:
    """The API server refuses to create an object of the replica; no event in the cluster reports it."""
    if it.seen.job is not None or not it.seen.denied or it.pod is not None:
        return None
    phase = Phase.SUSPENDED if it.job.spec.suspend else Phase.PENDING
    return Finding(told=told(Reason.PODS_REFUSED, words=it.seen.denied), phase=phase)


def name_taken(it: Situation) -> Finding | None:
    """Another Job has the replica's name."""
    obstacle = it.seen.obstacle
    if it.seen.job is not None or obstacle is None:
        return None
    deleting = " and is being deleted" if obstacle.deleting else ""
    return found(Reason.NAME_TAKEN, name=obstacle.name, deleting=deleting)


def old_pod_holds_claim(it: Situation) -> Finding | None:
    """A pod of an earlier TrainingJob of this name may still write to the claim that both name."""
    old = next(iter(it.seen.former), None)
    if it.seen.job is not None or old is None:
        return None
    claim, node = it.job.spec.storage.existing_claim, old.node or "unknown"
    return found(Reason.OLD_POD_TERMINATING, pod=old.name, claim=claim, node=node)


def pods_refused(it: Situation) -> Finding | None:
    """The API server refuses to create the pod; only the Job's events have the reason."""
    refused = it.seen.refused
    words = it.seen.denied or (refused.message if refused is not None else "")
    return None if it.pod is not None or not words else found(Reason.PODS_REFUSED, words=words)


def node_lost(it: Situation) -> Finding | None:
    """A deleted pod still exists long after its grace period."""
    pod = it.pod
    if pod is None or pod.gone_by is None:
        return None
    why = told(Reason.NODE_LOST, pod=pod.name, node=pod.node, seconds=LOST_AFTER_S)
    wait = Wait(key=("gone", pod.uid), seconds=pod.grace_s + LOST_AFTER_S)
    return replace(after(it, wait, why), phase=Phase.PENDING)  # as its node said last, it runs


def unschedulable(it: Situation) -> Finding | None:
    """No node takes the pod."""
    if it.pod is None or not it.pod.unschedulable:
        return None
    return found(Reason.UNSCHEDULABLE, pod=it.pod.name, words=it.pod.unschedulable)


def volume_not_mounted(it: Situation) -> Finding | None:
    """The pod is on a node, and a volume is not mounted; only the pod's events have the reason."""
    if it.pod is None or not it.seen.unmounted:
        return None
    return found(Reason.VOLUME_NOT_MOUNTED, pod=it.pod.name, words=it.seen.unmounted)


def image_does_not_come(it: Situation) -> Finding | None:
    """An image cannot be pulled; the kubelet tries again."""
    stuck = first_waiting(it.pod, PULLING)
    return None if stuck is None else of_image(stuck)


def container_refused(it: Situation) -> Finding | None:
    """The node cannot create a container; the kubelet tries again."""
    stuck = first_waiting(it.pod, MAKING)
    if stuck is None:
        return None
    words = stuck.waiting_message or stuck.waiting
    return found(Reason.CONTAINER_REFUSED, container=stuck.name, words=words)


def sidecar_out_of_memory(it: Situation) -> Finding | None:
    """A sidecar was killed for its memory; the kubelet starts it again."""
    stuck = next((each for each in crashing(it.pod) if killed_for_memory(each)), None)
    return None if stuck is None else Finding(told=of_crash(it, stuck))


def sidecar_crash_loops(it: Situation) -> Finding | None:
    """A sidecar does not stay up; the kubelet starts it again and again."""
    looping = next((each for each in crashing(it.pod) if each.restarts >= CRASHES), None)
    return None if looping is None else Finding(told=of_crash(it, looping))


def simulator_not_up(it: Situation) -> Finding | None:
    """A simulator takes long to start; the trainer gives it up when its fault budget is spent."""
    polled = it.seen.polled
    if it.pod is None or polled is None or it.trains or not it.fresh:
        return None
    up = {each.name: each for each in it.pod.sidecars if each.running_since is not None}
    states = (
        (each, up.get(f"sim-{each.name}")) for each in polled.status.simulators if each.state != "ready"
    )
    late = [_not_up(it, it.pod, each, sidecar) for each, sidecar in states if sidecar is not None]
    return min(late, key=lambda each: each.left_s, default=None)


def pod_filled_its_storage(it: Situation) -> Finding | None:
    """The newest pod was evicted for what it wrote, and no other is there yet."""
    why = None if it.seen.pod is None else storage_eviction(it.seen.pod)
    return None if why is None else Finding(told=why)


def pod_was_taken(it: Situation) -> Finding | None:
    """The newest pod was interrupted, and no other is there yet."""
    pod = it.seen.pod
    if pod is None or pod.phase != "Failed" or failed_by_itself(pod):
        return None
    if (mark := mark_of(it, pod)) is not None:
        return Finding(told=mark)
    if ended_by_suspension(it.seen, pod):  # and resumed: the next pod is on its way
        return None
    if pod.disruption or pod.gone_by is not None:
        return found(Reason.DISRUPTED, pod=pod.name, words=pod.disruption or "it was deleted")
    return found(Reason.INTERRUPTED, pod=pod.name, how=how_it_failed(it, pod))


def volume_is_full(it: Situation) -> Finding | None:
    """The newest pod could not write to the volume, and another will try."""
    pod = it.seen.pod
    if pod is None or not failed_by_itself(pod) or no_other_comes(it, pod):
        return None
    why = full_volume(it.seen.termination)
    return None if why is None else Finding(told=why)


def pod_failed(it: Situation) -> Finding | None:
    """The newest pod failed, and another will come."""
    pod = it.seen.pod
    if pod is None or not failed_by_itself(pod) or no_other_comes(it, pod):
        return None
    return found(Reason.RETRYING, pod=pod.name, how=how_it_failed(it, pod))


def no_other_comes(it: Situation, pod: PodView) -> bool:
    """Return whether a failed pod is the last one, because its Job is about to fail."""
    booked = it.seen.job.failures if it.seen.job is not None else 0
    failures = max(booked, it.counted.restarts.trainer + 1)  # the Job may not have counted the newest yet
    return failures > it.job.spec.backoff_limit or exit_code(pod) in GIVEN_UP


def of_image(stuck: ContainerView) -> Finding:
    """Return the finding about a container whose image cannot be pulled."""
    words = stuck.waiting_message or stuck.waiting
    return found(Reason.IMAGE_PULL, container=stuck.name, image=stuck.image, words=words)


def mark_of(it: Situation, pod: PodView) -> Told | None:
    """Return why the operator replaces a pod, by the mark on its Job; None if it does not."""
    mark = it.seen.job.replaced if it.seen.job is not None else None
    if mark is None or mark.pod != pod.uid:
        return None
    return Told(reason=Reason.known(mark.reason), message=mark.message or mark.reason)


def _not_up(it: Situation, pod: PodView, simulator: SimulatorStatus, sidecar: ContainerView) -> Finding:
    seconds = it.start_deadline_s(sidecar.name)
    fault = f": {simulator.last_fault}" if simulator.last_fault else ""
    what = f"{sidecar.name} is not up within {seconds} s of its container's start{fault}"
    wait = Wait(key=("start", pod.uid, sidecar.name, str(sidecar.restarts)), seconds=seconds)
    return after(it, wait, told(Reason.SIMULATOR_START_DEADLINE, what=what))


def crashing(pod: PodView | None) -> tuple[ContainerView, ...]:
    """Return the sidecars that do not run now, though they have before."""
    sidecars = pod.sidecars if pod is not None else ()
    return tuple(each for each in sidecars if each.running_since is None and each.exit is not None)


def storage_eviction(pod: PodView) -> Told | None:
    """Return the reason if a node evicted the pod because it wrote too much, else None."""
    if pod.reason != "Evicted" or "ephemeral" not in pod.message.lower():
        return None
    return told(Reason.EPHEMERAL_STORAGE, pod=pod.name, words=pod.message)


def full_volume(word: Termination | None) -> Told | None:
    """Return the reason if a trainer could not write to its full volume, else None."""
    if word is None or not word.reason.startswith(FULL):
        return None
    fact = word.reason.partition(": ")[2].partition("; ")[0]  # its remedy is ours
    return told(Reason.STORAGE_FULL, words=fact or "no space left")


def of_crash(it: Situation, container: ContainerView) -> Told:
    """Return the reason for a sidecar that crashed."""
    if killed_for_memory(container):
        times, limit = kills_of(it, container.name), limit_of(container.memory_limit)
        return told(Reason.SIMULATOR_OUT_OF_MEMORY, container=container.name, limit=limit, times=times)
    times = max(container.restarts, 1)
    code = container.exit.code if container.exit is not None else "unknown"
    return told(Reason.SIDECAR_CRASH_LOOP, container=container.name, times=times, how=f"exit code {code}")


def how_it_failed(it: Situation, pod: PodView) -> str:
    """Return how a pod failed, in the best words that are known."""
    word = it.seen.terminations.get(pod.uid)
    trainer = pod.trainer
    if trainer is not None and killed_for_memory(trainer):
        return "the trainer was killed because it ran out of memory"
    code = exit_code(pod)
    if word is not None and word.reason:
        return f"exit code {code}, {word.reason}"
    if code is None and (before := _failed_before(pod)) is not None and before.exit is not None:
        line = _last_line(before) or before.exit.reason or "no word"
        return f"container {before.name}: exit code {before.exit.code}, {line}"
    words = _last_line(trainer) or pod.message or pod.reason or "no word from the trainer"
    return f"exit code {code}, {words}" if code is not None else words


def _failed_before(pod: PodView) -> ContainerView | None:
    """Return the failed container among those that must succeed before the others start, if any."""
    init = (each for each in pod.containers if each.kind is ContainerKind.INIT)
    return next((each for each in init if each.exit is not None and each.exit.code), None)


def left_by(pod: PodView) -> str:
    """Return the end of the log of a pod's trainer, or of the container that kept it from starting."""
    failed = _failed_before(pod)
    trainer = pod.trainer
    ends = [each.exit for each in (trainer, failed) if each is not None and each.exit is not None]
    return next((end.message for end in ends if end.message), "")


def _last_line(container: ContainerView | None) -> str:
    """Return the last line of a container's termination message."""
    log = container.exit.message if container is not None and container.exit is not None else ""
    return next(iter(log.strip().splitlines()[-1:]), "")
