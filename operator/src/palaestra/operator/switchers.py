"""Who suspended or resumed a Job of ours, where the operator did not: its field manager.

The caches hold no managedFields, which are half of an object, so a Job that differs from what the operator
set is read once for each change of its spec.
"""

import threading
from collections import OrderedDict
from collections.abc import Sequence

from palaestra.api import TrainingJob
from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import JOBS
from palaestra.decide.suspending import overruled
from palaestra.observe import Raw
from palaestra.observe.jobs import job_view
from palaestra.observe.managers import suspends
from palaestra.observe.reading import count, owners

REMEMBERED = 1000  # changes of Jobs; what was deleted meanwhile is among them

Change = tuple[str, int]  # uid and generation of a Job


class Switchers:
    """The field managers of `spec.suspend`, by Job and generation; safe to use from several threads."""

    def __init__(self, api: Api) -> None:
        self._api = api
        self._lock = threading.Lock()
        self._names: OrderedDict[Change, str] = OrderedDict()

    def of(self, job: TrainingJob, jobs: Sequence[Raw]) -> dict[str, str]:
        """Return the field manager for the uid of each Job that is not as the operator set it.

        Raises:
            ApiError: a Job had to be read, and there was no answer.
        """
        ours = ((raw, job_view(raw)) for raw in jobs if job.metadata.uid in owners(raw))
        return {view.uid: self._name(raw) for raw, view in ours if overruled(job, view)}

    def _name(self, raw: Raw) -> str:
        metadata = raw["metadata"]
        change = (metadata["uid"], count(metadata, "generation"))
        with self._lock:
            known = self._names.get(change)
        if known is not None:
            return known
        try:
            found = self._api.get(JOBS.only_metadata(), metadata["namespace"], metadata["name"])
        except NotFound:  # the cache hears of it soon
            return ""
        name = suspends(found)
        with self._lock:
            self._names[change] = name
            while len(self._names) > REMEMBERED:
                self._names.popitem(last=False)
        return name
