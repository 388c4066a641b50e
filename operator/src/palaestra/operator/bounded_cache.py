"""Bounded memory for facts that no watch reports, by TrainingJob.

One policy applies to all of them. Each reconcile replaces the values of the previous one, and the values of a
deleted or recreated TrainingJob are dropped, so the memory holds only facts about existing objects. If it is
full, it accepts no new value until another one is dropped. Eviction of the oldest would be worse: with
thousands of jobs in turn, each would evict another one, and no value would stay.
"""

import threading
from collections.abc import Hashable, Mapping
from typing import Generic, TypeVar

from palaestra.objects import Key

REMEMBERED = 4000  # objects of all jobs together; each has one message

Item = TypeVar("Item", bound=Hashable)
Value = TypeVar("Value")


class BoundedCache(Generic[Item, Value]):
    """Values by TrainingJob and item; safe for several threads, if each job is used by one at a time."""

    def __init__(self) -> None:
        self._lock = threading.RLock()
        self._values: dict[Key, tuple[str, Mapping[Item, Value]]] = {}
        self._size = 0

    def known(self, key: Key, uid: str) -> Mapping[Item, Value]:
        """Return the values of a TrainingJob."""
        with self._lock:
            known_uid, values = self._values.get(key, (uid, {}))
            if known_uid == uid:
                return values
            self.forget(key)
            return {}

    def keep(self, key: Key, uid: str, values: Mapping[Item, Value]) -> Mapping[Item, Value]:
        """Replace the values of a TrainingJob by `values`; return those for which there is room.

        An existing item keeps its place.
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
