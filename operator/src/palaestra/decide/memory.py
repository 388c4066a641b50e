"""Containers that were killed for their memory: whose, how often, and at which limit.

On cgroup v2 the kernel kills a container as a whole, its sidecar with it, and the kubelet starts it anew
within a second. Then nothing but its last end tells a simulator that needed too much from one that crashed.
"""

from palaestra.api.history import MemoryKills
from palaestra.decide.situation import Situation
from palaestra.observe.reading import MOST_COUNT
from palaestra.observe.views import ContainerView

OUT_OF_MEMORY = "OOMKilled"
MOST_CONTAINERS = 64  # as the status holds


def killed_for_memory(container: ContainerView) -> bool:
    """Return whether a container's last end was the kernel's, for its memory."""
    return container.exit is not None and container.exit.reason == OUT_OF_MEMORY


def memory_kills(it: Situation) -> tuple[MemoryKills, ...]:
    """Return the kills by container, those that are seen for the first time added."""
    kills = {each.container: each for each in it.old.memory_kills}
    for container in (each for pod in it.seen.pods for each in pod.containers):
        at = container.exit.at if container.exit is not None else None
        before = kills.get(container.name)
        known = before is not None and at is not None and at <= before.last
        if killed_for_memory(container) and at is not None and not known:
            kills[container.name] = MemoryKills(
                container=container.name or "unnamed",
                times=min((before.times if before else 0) + 1, MOST_COUNT),
                limit=container.memory_limit or None,
                last=at,
            )
    return tuple(kills.values())[:MOST_CONTAINERS]


def kills_of(it: Situation, container: str) -> int:
    """Return how often a container was killed for its memory, as far as it was seen."""
    return next((each.times for each in memory_kills(it) if each.container == container), 1)


def limit_of(limit: str | None) -> str:
    """Return a memory limit in words."""
    return f"limit {limit}" if limit else "no limit, so its node ran short"
