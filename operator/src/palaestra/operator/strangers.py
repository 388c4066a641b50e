"""Jobs that have a name of ours and are not ours: of an earlier TrainingJob, or of somebody else.

No cache holds them, as they need not carry our label. One is met when a Job cannot be created because
its name is taken, and is looked at again, now and then, until it is gone.
"""

import time
from collections.abc import Callable, Collection
from typing import Any

from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import JOBS
from palaestra.observe import trimmed
from palaestra.operator.memory import Memory
from palaestra.operator.poller import Key

RECHECK_S = 10.0

Object = dict[str, Any]


class Strangers(Memory[str, tuple[float, Object]]):
    """When a stranger was met last, and what it was, by TrainingJob and name.

    Args:
        api: the cluster.
        clock: seconds that never go back.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._api = api
        self._clock = clock

    def meet(self, key: Key, uid: str, name: str) -> Object | None:
        """Return the Job that has a name which a TrainingJob needs, and remember it; None: it is gone."""
        others = {each: met for each, met in self.known(key, uid).items() if each != name}
        try:
            found = trimmed(self._api.get(JOBS, key[0], name))
        except NotFound:
            self.keep(key, uid, others)
            return None
        self.keep(key, uid, {**others, name: (self._clock(), found)})
        return found

    def among(self, key: Key, uid: str, cached: Collection[str]) -> list[Object]:
        """Return the strangers in the way of a TrainingJob, as they were ten seconds ago at most.

        `cached` are the names of the Jobs that are in the cache: those are no strangers any more.
        """
        met = {name: met for name, met in self.known(key, uid).items() if name not in cached}
        self.keep(key, uid, met)
        for name, (at, _) in met.items():
            if self._clock() - at >= RECHECK_S:
                self.meet(key, uid, name)
        return [found for _, found in self.known(key, uid).values()]
