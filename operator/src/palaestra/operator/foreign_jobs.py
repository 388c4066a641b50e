"""Foreign Jobs: they have a name that a TrainingJob needs, but belong to an earlier one or to another owner.

They are not cached, because they may lack the label of the operator's objects. The operator finds one if a
Job cannot be created because its name is taken. It reads that Job again every few seconds until it is gone.
"""

import time
from collections.abc import Callable, Collection

from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import JOBS
from palaestra.objects import Key, Object
from palaestra.observe import trimmed
from palaestra.operator.bounded_cache import BoundedCache

RECHECK_S = 10.0


class ForeignJobs(BoundedCache[str, tuple[float, Object]]):
    """The time of the last read and the object of each foreign Job, by TrainingJob and name.

    Args:
        api: the cluster.
        clock: a monotonic clock, in seconds.
    """

    def __init__(self, api: Api, clock: Callable[[], float] = time.monotonic) -> None:
        super().__init__()
        self._api = api
        self._clock = clock

    def meet(self, key: Key, uid: str, name: str) -> Object | None:
        """Return and remember the Job whose name a TrainingJob needs; None if it is gone."""
        others = {other: met for other, met in self.known(key, uid).items() if other != name}
        try:
            found = trimmed(self._api.get(JOBS, key[0], name))
        except NotFound:
            self.keep(key, uid, others)
            return None
        self.keep(key, uid, {**others, name: (self._clock(), found)})
        return found

    def among(self, key: Key, uid: str, cached: Collection[str]) -> list[Object]:
        """Return the foreign Jobs whose names a TrainingJob needs, as read at most ten seconds ago.

        `cached` are the names of the Jobs in the cache, which are not foreign.
        """
        met = {name: met for name, met in self.known(key, uid).items() if name not in cached}
        self.keep(key, uid, met)
        for name, (at, _) in met.items():
            if self._clock() - at >= RECHECK_S:
                self.meet(key, uid, name)
        return [found for _, found in self.known(key, uid).values()]
