"""The field manager that suspended or resumed a Job of the operator, if it was not the operator itself.

The caches do not store managedFields, which are half of an object. So if the `suspend` of a Job differs from
the operator's last value, the Job is read once for each change of its spec.
"""

from collections.abc import Sequence

from palaestra.api import TrainingJob
from palaestra.cluster import Api, NotFound
from palaestra.cluster.resources import JOBS
from palaestra.decide.suspend import overruled
from palaestra.objects import Key
from palaestra.observe import Raw
from palaestra.observe.jobs import job_view
from palaestra.observe.json_access import count, owners
from palaestra.observe.managed_fields import suspends
from palaestra.operator.bounded_cache import BoundedCache

Change = tuple[str, int]  # uid and generation of a Job


class SuspendManagers(BoundedCache[Change, str]):
    """The field managers of `spec.suspend`, by TrainingJob and change of a Job."""

    def __init__(self, api: Api) -> None:
        super().__init__()
        self._api = api

    def of(self, key: Key, uid: str, job: TrainingJob, jobs: Sequence[Raw]) -> dict[str, str]:
        """Return the field manager by the uid of each Job whose `suspend` differs from the operator's value.

        Raises:
            ApiError: the read of a Job failed.
        """
        ours = ((raw, job_view(raw)) for raw in jobs if uid in owners(raw))
        differ = [(view.uid, raw) for raw, view in ours if overruled(job, view)]
        changed = {(each, count(raw["metadata"], "generation")): raw for each, raw in differ}
        known = self.known(key, uid)
        names = {each: known[each] if each in known else self._name(raw) for each, raw in changed.items()}
        self.keep(key, uid, names)
        return {each: name for (each, _), name in names.items()}

    def _name(self, raw: Raw) -> str:
        metadata = raw["metadata"]
        try:
            return suspends(self._api.get(JOBS.only_metadata(), metadata["namespace"], metadata["name"]))
        except NotFound:  # the cache receives the deletion soon
            return ""
