"""The end of a pod and its containers: a description of the end, and the count of out-of-memory kills.

On cgroup v2 the kernel kills a whole container, including the sidecar process, and the kubelet restarts the
container within a second. Then only the container's last termination state shows that the simulator ran out
of memory.
"""

from datetime import datetime

from palaestra.api.attempt_status import MemoryKills
from palaestra.api.reasons import Reason
from palaestra.decide.explanation import Explanation, explain
from palaestra.decide.replica_context import ReplicaContext, next_pod
from palaestra.decide.restart_counts import exit_code, newer_pods
from palaestra.observe.json_access import MOST_COUNT
from palaestra.observe.models import ContainerKind, ContainerView, PodView
from palaestra.plan.replica import TRAINER
from palaestra_protocol.pod.status import Termination

OUT_OF_MEMORY = "OOMKilled"
MOST_CONTAINERS = 64  # the limit of the list `memoryKills` in the status
FULL = "StorageFull"  # the first word of a termination message


def how_it_failed(situation: ReplicaContext, pod: PodView) -> str:
    """Return the most detailed known description of a pod's failure."""
    word = situation.seen.terminations.get(pod.uid)
    trainer = pod.trainer
    if trainer is not None and killed_for_memory(trainer):
        return "the trainer was killed because it ran out of memory"
    code = exit_code(pod)
    newest = situation.seen.pod is not None and situation.seen.pod.uid == pod.uid
    if newest and situation.seen.probe:
        return (
            f"exit code {code}, the kubelet ended the trainer because its {situation.seen.probe} probe failed"
        )
    if word is not None and word.reason:
        return f"exit code {code}, {word.reason}"
    if code is None and (before := _failed_before(pod)) is not None and before.exit is not None:
        line = _last_line(before) or before.exit.reason or "no word"
        return f"container {before.name}: exit code {before.exit.code}, {line}"
    words = _last_line(trainer) or pod.message or pod.reason or "no message from the trainer"
    return f"exit code {code}, {words}" if code is not None else words


def left_by(pod: PodView) -> str:
    """Return the last log lines of a pod's trainer, or of the failed init container before it."""
    failed = _failed_before(pod)
    trainer = pod.trainer
    ends = [
        container.exit
        for container in (trainer, failed)
        if container is not None and container.exit is not None
    ]
    return next((end.message for end in ends if end.message), "")


def probe_failed(situation: ReplicaContext, pod: PodView) -> Explanation:
    """Return the explanation for a trainer that the kubelet ended because a probe failed."""
    code, probe, begins = exit_code(pod), situation.seen.probe, next_pod(situation)
    how = f"exit code {code}"
    return explain(Reason.PROBE_FAILED, pod=pod.name, probe=probe, how=how, next_pod=begins)


def mark_of(situation: ReplicaContext, pod: PodView) -> Explanation | None:
    """Return the reason for the replacement of a pod, from the mark on its Job; None without a mark."""
    mark = situation.seen.job.replaced if situation.seen.job is not None else None
    if mark is None or mark.pod != pod.uid:
        return None
    return Explanation(reason=Reason.known(mark.reason), message=mark.message or mark.reason)


def storage_eviction(pod: PodView) -> Explanation | None:
    """Return the reason if a node evicted the pod because the pod wrote too much data, else None."""
    if pod.reason != "Evicted" or "ephemeral" not in pod.message.lower():
        return None
    return explain(Reason.EPHEMERAL_STORAGE, pod=pod.name, words=pod.message)


def full_volume(word: Termination | None) -> Explanation | None:
    """Return the reason if a trainer could not write to its full volume, else None."""
    if word is None or not word.reason.startswith(FULL):
        return None
    # Cut the remedy, because the text of the reason `StorageFull` has its own remedy.
    fact = word.reason.partition(": ")[2].partition("; ")[0]
    return explain(Reason.STORAGE_FULL, words=fact or "no space left")


def killed_for_memory(container: ContainerView) -> bool:
    """Return whether the kernel ended a container because it ran out of memory."""
    return container.exit is not None and container.exit.reason == OUT_OF_MEMORY


def memory_kills(situation: ReplicaContext) -> tuple[MemoryKills, ...]:
    """Return the out-of-memory kills by container, including the new kills in this observation.

    A kill is identified by its pod and the number of the container's run in this pod. All kills in pods older
    than the pod in the status were counted before.
    """
    kills = {kill.container: kill for kill in situation.old.memory_kills}
    named = [
        pod
        for pod in situation.seen.pods
        if situation.old.pod is not None and pod.uid == situation.old.pod.uid
    ]
    for pod in (*named, *newer_pods(situation.old, situation.seen.pods)):
        for container in pod.containers:
            before = kills.get(container.name)
            ours = container.simulates or container.name == TRAINER
            if ours and killed_for_memory(container) and not _known(before, pod, container):
                kills[container.name] = _one_more(before, pod, container, situation.now)
    return tuple(kills.values())[:MOST_CONTAINERS]


def kills_of(situation: ReplicaContext, container: str) -> int:
    """Return the number of times that a container was killed because it ran out of memory."""
    return next((kill.times for kill in memory_kills(situation) if kill.container == container), 1)


def limit_of(limit: str | None) -> str:
    """Return the text about a memory limit."""
    return f"limit {limit}" if limit else "no limit, so its node ran out of memory"


def _failed_before(pod: PodView) -> ContainerView | None:
    """Return the first failed init container; the other containers start only after it succeeds."""
    init = (container for container in pod.containers if container.kind is ContainerKind.INIT)
    return next((container for container in init if container.exit is not None and container.exit.code), None)


def _last_line(container: ContainerView | None) -> str:
    """Return the last line of a container's termination message."""
    log = container.exit.message if container is not None and container.exit is not None else ""
    return next(iter(log.strip().splitlines()[-1:]), "")


def _known(before: MemoryKills | None, pod: PodView, container: ContainerView) -> bool:
    """Return whether a kill was counted before.

    If `fitted` dropped pod and run from the status because it was too long, a kill is recognized by its time.
    The two compared times may come from the clocks of two nodes.
    """
    if before is None:
        return False
    if before.pod is None or before.run is None:
        at = container.exit.at if container.exit is not None else None
        return at is None or at <= before.last
    return before.pod == pod.uid and container.ended_run <= before.run


def _one_more(
    before: MemoryKills | None, pod: PodView, container: ContainerView, now: datetime
) -> MemoryKills:
    at = container.exit.at if container.exit is not None else None
    return MemoryKills(
        container=container.name or "unnamed",
        times=min((before.times if before else 0) + 1, MOST_COUNT),
        limit=container.memory_limit or None,
        last=at or now,
        pod=pod.uid,
        run=container.ended_run,
    )
