"""Until when a replica has time: at each of these moments it is stopped for good.

Each check returns the moment and the reason, or None where no such clock runs. A clock that runs from
something seen starts there; one that runs from a trouble starts when the status first told of it.
"""

from datetime import datetime

from palaestra.api.reasons import Reason
from palaestra.decide.conditions import Told
from palaestra.decide.counting import failed_by_itself
from palaestra.decide.moments import after, seconds_between
from palaestra.decide.progress import last_progress
from palaestra.decide.situation import Deadline, DeadlineCheck, Situation, first_waiting, told
from palaestra.decide.troubles import (
    CRASHES,
    MAKING,
    PULLING,
    container_refused,
    crashing,
    image_does_not_come,
    of_crash,
    restart_policy_dropped,
    storage_eviction,
)
from palaestra.observe.views import ContainerView, PodView
from palaestra_sim.protocol.status import SimulatorStatus

FRUITLESS_PODS = 6  # in a row; as many as Kubernetes' own default for failures
UNSAID_S = 60  # more than the start deadline, for a trainer that has not told of a failed start
STALL_GRACE_S = 120  # in which the trainer's own watchdog has ended it
FORGOTTEN_S = 300  # a node needs seconds to start the trainer; its image is the ROS master's
FRESH_S = 45  # an older answer is no word of what is now


def active_deadline(it: Situation) -> Deadline | None:
    """The job was active as long as it may."""
    if it.deadline is None or (seconds := it.job.spec.active_deadline_seconds) is None:
        return None
    return Deadline(at=it.deadline, told=told(Reason.DEADLINE_EXCEEDED, seconds=seconds))


def no_progress(it: Situation) -> Deadline | None:
    """Pods that are taken again and again count against no limit of Kubernetes."""
    pods = it.counted.fruitless + _taken_and_not_replaced(it)
    if pods < FRUITLESS_PODS:
        return None
    evictions = (storage_eviction(pod) for pod in reversed(it.seen.pods) if pod.ended)
    cause = next(evictions, None)  # of the last that ended
    return Deadline(at=it.now, told=cause or told(Reason.NO_PROGRESS, pods=pods))


def _taken_and_not_replaced(it: Situation) -> bool:
    """Return whether the newest pod was taken: Kubernetes doubles the wait for the next each time."""
    pod = it.seen.pod
    return pod is not None and pod.phase == "Failed" and not failed_by_itself(pod)


def restart_policy_is_gone(it: Situation) -> Deadline | None:
    """Such a pod never starts its trainer."""
    trouble = restart_policy_dropped(it)
    return None if trouble is None else Deadline(at=it.now, told=trouble)


def image_never_came(it: Situation) -> Deadline | None:
    """A registry may be away for a while, not for ever."""
    return _of_waiting(it, PULLING, image_does_not_come(it))


def container_never_made(it: Situation) -> Deadline | None:
    """A Secret's key may be late, as the registry may."""
    return _of_waiting(it, MAKING, container_refused(it))


def sidecar_kept_crashing(it: Situation) -> Deadline | None:
    """Before the training a crash loop is fatal at the start deadline; later, the trainer decides."""
    pod = it.pod
    looping = next((each for each in crashing(pod) if each.restarts >= CRASHES), None)
    if pod is None or pod.started is None or looping is None or not _waits_for_simulators(it, pod):
        return None
    return Deadline(at=after(pod.started, it.start_deadline_s(looping.name)), told=of_crash(it, looping))


def simulator_never_started(it: Situation) -> Deadline | None:
    """By the trainer's own word; from the start of the simulator's container, images not counted."""
    late = [each for each in _starting(it) if (each[1].running_since is not None)]
    clocks = [(_start_clock(it, *each), each[0]) for each in late]
    if not clocks:
        return None
    at, simulator = min(clocks, key=lambda each: each[0])
    return Deadline(at=at, told=told(Reason.SIMULATOR_START_DEADLINE, what=_not_up(it, simulator)))


def trainer_never_started(it: Situation) -> Deadline | None:
    """All sidecars run, and the node forgot the trainer."""
    pod = it.pod
    if pod is None or pod.trainer is None or not pod.sidecars or pod.gone_by is not None:
        return None
    begun = [each.running_since for each in pod.sidecars if each.running_since and each.started]
    waits = pod.trainer.waiting == "PodInitializing"
    if not waits or len(begun) < len(pod.sidecars):
        return None
    reason = told(Reason.TRAINER_NOT_STARTED, pod=pod.name, seconds=FORGOTTEN_S)
    return Deadline(at=after(max(begun), FORGOTTEN_S), told=reason)


def stalled(it: Situation) -> Deadline | None:
    """The trainer answers, its step count does not move, and its watchdog has not ended it."""
    moved = last_progress(it)
    if moved is None or not it.trains or not _fresh(it):
        return None
    seconds = it.job.spec.stall_deadline_seconds
    what = f"no step was learned from since {moved:%Y-%m-%dT%H:%M:%SZ}, for more than {seconds} s"
    return Deadline(at=after(moved, seconds + STALL_GRACE_S), told=told(Reason.STALLED, what=what))


DEADLINES: tuple[DeadlineCheck, ...] = (
    restart_policy_is_gone,
    image_never_came,
    container_never_made,
    sidecar_kept_crashing,
    simulator_never_started,
    trainer_never_started,
    stalled,
    no_progress,
    active_deadline,
)


def _waits_for_simulators(it: Situation, pod: PodView) -> bool:
    """Return whether the training of a pod has not begun, as far as is known.

    A trainer that told how far it is and does not answer now is unknown, and one that has ended needs its
    simulators no more, nor does a pod that somebody deleted.
    """
    over = pod.gone_by is not None or (pod.trainer is not None and pod.trainer.exit is not None)
    unknown = it.seen.polled is None and it.old.target is not None
    runs = pod.trainer is not None and pod.trainer.running_since is not None
    return not over and not it.trains and not (runs and unknown)


def _of_waiting(it: Situation, reasons: frozenset[str], trouble: Told | None) -> Deadline | None:
    stuck = first_waiting(it.pod, reasons)
    if stuck is None or trouble is None:
        return None
    return Deadline(at=after(it.since(trouble.reason), it.start_deadline_s(stuck.name)), told=trouble)


def _starting(it: Situation) -> list[tuple[SimulatorStatus, ContainerView]]:
    """Return the simulators that their trainer has not brought up yet, with their containers."""
    if it.pod is None or it.seen.polled is None or it.trains or not _fresh(it):
        return []
    containers = {each.name: each for each in it.pod.sidecars}
    return [
        (simulator, containers[f"sim-{simulator.name}"])
        for simulator in it.seen.polled.status.simulators
        if simulator.state != "ready" and f"sim-{simulator.name}" in containers
    ]


def _start_clock(it: Situation, simulator: SimulatorStatus, container: ContainerView) -> datetime:
    """Return until when a simulator may come up; a trainer that had no chance to try has more time."""
    begun = container.running_since or it.now
    tried = simulator.last_fault is not None or simulator.restarts > 0
    return after(begun, it.start_deadline_s(container.name) + (0 if tried else UNSAID_S))


def _not_up(it: Situation, simulator: SimulatorStatus) -> str:
    seconds = it.start_deadline_s(f"sim-{simulator.name}")
    fault = f": {simulator.last_fault}" if simulator.last_fault else ""
    return f"sim-{simulator.name} is not up within {seconds} s of its container's start{fault}"


def _fresh(it: Situation) -> bool:
    return it.seen.polled is not None and seconds_between(it.seen.polled.at, it.now) <= FRESH_S
