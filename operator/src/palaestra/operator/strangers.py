"""Jobs that have a name of ours and are not ours: of an earlier TrainingJob, or of somebody else.

No cache holds them, as they need not carry our label. One is met when a Job cannot be created because
its name is taken, and is looked at again, now and then, until it is gone.
"""

import threading
import time
from collections.abc import Callable, Collection
from typing import Any

from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import JOBS
from palaestra.operator.poller import Key

RECHECK_S = 10.0

Object = dict[str, Any]


class Strangers:
    """The strangers that were met, by TrainingJob; safe to use from several threads.

    Args:
        api: the cluster.
        clock: seconds that never go back.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        self._api = api
        self._clock = clock
        self._lock = threading.Lock()
        self._met: dict[Key, dict[str, tuple[float, Object]]] = {}

    def meet(self, key: Key, name: str) -> Object | None:
        """Return the Job that has a name which a TrainingJob needs, and remember it; None: it is gone."""
        try:
            found = self._api.get(JOBS, key[0], name)
        except NotFound:
            self._forget(key, name)
            return None
        with self._lock:
            self._met.setdefault(key, {})[name] = (self._clock(), found)
        return found

    def among(self, key: Key, known: Collection[str]) -> list[Object]:
        """Return the strangers in the way of a TrainingJob, as they were ten seconds ago at most.

        `known` are the names of the Jobs that are in the cache: those are no strangers any more.
        """
        with self._lock:
            met = {name: at for name, (at, _) in self._met.get(key, {}).items()}
        for name, at in met.items():
            if name in known:
                self._forget(key, name)
            elif self._clock() - at >= RECHECK_S:
                self.meet(key, name)
        with self._lock:
            return [found for _, found in self._met.get(key, {}).values()]

    def forget(self, key: Key) -> None:
        """Forget those of a TrainingJob that is gone."""
        with self._lock:
            self._met.pop(key, None)

    def _forget(self, key: Key, name: str) -> None:
        with self._lock:
            self._met.get(key, {}).pop(name, None)
