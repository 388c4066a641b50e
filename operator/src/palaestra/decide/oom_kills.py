"""Containers that were killed because they ran out of memory, with the number of kills and the limit.

On cgroup v2 the kernel kills a whole container, including the sidecar process, and the kubelet restarts it
within a second. Then only the container's last termination state shows that the simulator ran out of memory.
"""

from datetime import datetime

from palaestra.api.attempt_status import MemoryKills
from palaestra.decide.replica_context import ReplicaContext
from palaestra.decide.restart_counts import newer_pods
from palaestra.observe.json_access import MOST_COUNT
from palaestra.observe.models import ContainerView, PodView
from palaestra.plan.replica import TRAINER

OUT_OF_MEMORY = "OOMKilled"
MOST_CONTAINERS = 64  # the limit of the status field


def killed_for_memory(container: ContainerView) -> bool:
    """Return whether the kernel ended a container because it ran out of memory."""
    return container.exit is not None and container.exit.reason == OUT_OF_MEMORY


def memory_kills(situation: ReplicaContext) -> tuple[MemoryKills, ...]:
    """Return the kills by container, including the new ones in this observation.

    A kill is identified by its pod and the container's run in it. All kills in pods older than the one in the
    status are counted already.
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


def _known(before: MemoryKills | None, pod: PodView, container: ContainerView) -> bool:
    """Return whether a kill was counted.

    If the status had no room for its pod and run, a kill is recognized by its time. The two times may come
    from the clocks of two nodes.
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


def kills_of(situation: ReplicaContext, container: str) -> int:
    """Return the number of times that a container was killed because it ran out of memory."""
    return next((kill.times for kill in memory_kills(situation) if kill.container == container), 1)


def limit_of(limit: str | None) -> str:
    """Return the text about a memory limit."""
    return f"limit {limit}" if limit else "no limit, so its node ran short"
