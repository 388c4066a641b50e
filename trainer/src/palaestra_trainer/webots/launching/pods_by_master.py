"""The pods of this program; a pod may use the ROS master in another pod."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

Remove = Callable[[], None]


@dataclass(slots=True)
class _Pod:
    """A pod: the address of its ROS master, its removal, and whether the program uses its simulator."""

    master: str
    remove: Remove
    used: bool = True


class PodsByMaster:
    """The pods of this program by their address; a pod stays while another pod uses its ROS master."""

    def __init__(self) -> None:
        self._pods: dict[str, _Pod] = {}

    def add(self, address: str, master: str, remove: Remove) -> None:
        """Add a pod that uses the ROS master at the address `master`, which may be its own."""
        self._pods[address] = _Pod(master, remove)

    def close(self, address: str) -> list[Remove]:
        """Record that the program no longer uses a pod's simulator; return the removals that this allows."""
        self._pods[address].used = False
        needed = {pod.master for pod in self._pods.values() if pod.used}
        unused = [name for name, pod in self._pods.items() if not pod.used and name not in needed]
        return [self._pods.pop(name).remove for name in unused]
