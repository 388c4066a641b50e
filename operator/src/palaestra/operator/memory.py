"""What no watch reports and the operator has to remember: bounded, and of TrainingJobs that there are.

One policy for all of it. What a look leaves takes the place of what the one before left, and nothing stays of
a TrainingJob that is gone, or was made again under its name: so memory holds only what there is. When it is
full it takes nothing new until something goes. Were the oldest pushed out instead, thousands that are looked
at in turn would push each other out, and none would be remembered.
"""

import threading
from collections.abc import Hashable, Mapping
from typing import Generic, TypeVar

from palaestra.operator.poller import Key

REMEMBERED = 4000  # objects, of all jobs together, with a message each

Item = TypeVar("Item", bound=Hashable)
Value = TypeVar("Value")


class Memory(Generic[Item, Value]):
    """Values by TrainingJob and item; safe to use from several threads, each job from one at a time."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._values: dict[Key, tuple[str, Mapping[Item, Value]]] = {}
        self._size = 0

    def known(self, key: Key, uid: str) -> Mapping[Item, Value]:
        """Return what was kept of a TrainingJob."""
        with self._lock:
            known_uid, values = self._values.get(key, (uid, {}))
            if known_uid == uid:
                return values
            self.forget(key)
            return {}

    def keep(self, key: Key, uid: str, values: Mapping[Item, Value]) -> Mapping[Item, Value]:
        """Remember `values` of a TrainingJob and nothing else; return those for which there is room.

        An item that was known before has its place.
        """
        with self._lock:
            before = self.known(key, uid)
            self.forget(key)
            ordered = sorted(values, key=lambda item: item not in before)
            kept = {item: values[item] for item in ordered[: REMEMBERED - self._size]}
            if kept:
                self._values[key] = uid, kept
                self._size += len(kept)
            return kept

    def forget(self, key: Key) -> None:
        """Forget a TrainingJob that is gone."""
        with self._lock:
            _, values = self._values.pop(key, ("", {}))
            self._size -= len(values)
