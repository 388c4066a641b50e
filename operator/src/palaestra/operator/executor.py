"""Execute actions: create missing objects, stop, replace, suspend, resume, delete.

Each action can be repeated safely. The names of objects are deterministic, so a repeated creation fails with
"already exists". If an action fails, the actions for other replicas are still executed.
"""

from http import HTTPStatus

import structlog

from palaestra.cluster import AlreadyExists, Api, ApiError, Conflict, NotFound
from palaestra.cluster.resources import CONFIG_MAPS, JOBS, NETWORK_POLICIES, TRAINING_JOBS, resource_of
from palaestra.decide import Action, Create, Delete, Discard, Replace, SetSuspend, Stop
from palaestra.objects import Key, Object
from palaestra.observe.json_access import owners
from palaestra.operator.fenced_client import FencedClient
from palaestra.operator.preconditions import Outdated, confirm
from palaestra.operator.unwatched_facts import Denied, ForeignJobs, RejectedCreations

log = structlog.get_logger(__name__)


class Executor:
    """Executes actions.

    Args:
        api: the cluster, for reads that must not come from a cache.
        writer: writes to the cluster while this operator leads.
        strangers: stores the foreign Jobs, which belong to other owners and have names that this operator's
            Jobs need.
        denials: stores refused creations.
    """

    def __init__(
        self, api: Api, writer: FencedClient, strangers: ForeignJobs, denials: RejectedCreations
    ) -> None:
        self._api = api
        self._writer = writer
        self._strangers = strangers
        self._denials = denials

    def carry_out(self, raw: Object, actions: tuple[Action, ...], *, confirmed: bool = False) -> Denied:
        """Execute `actions` for a TrainingJob, in order; return the errors by replica.

        The result is empty if all actions succeeded.

        `confirmed`: the actions follow from the status just written, so no read must confirm them.

        After an error, the later actions for the same replica are skipped. If the error is about the whole
        job, all later creations are skipped, because no pod may run without its network policy.

        Raises:
            Outdated: the cluster has changed since the decision; some of the actions may have been executed.
            NotLeading: another operator may lead.
        """
        if not confirmed:
            confirm(self._api, raw, actions)
        refused: dict[int | None, ApiError] = {}
        denied: dict[int | None, ApiError] = {}
        changed: Conflict | NotFound | None = None
        for action in actions:
            replica = None if isinstance(action, Delete) else action.replica
            if replica in refused or (None in refused and isinstance(action, Create)):
                continue
            try:
                self._do(raw, action)
            except ApiError as error:
                refused[replica] = error
                if isinstance(error, (Conflict, NotFound)) and not isinstance(action, Create):
                    changed = error
                elif isinstance(action, Create | Replace):
                    denied[replica] = error
        metadata = raw["metadata"]
        self._denials.learn((metadata["namespace"], metadata["name"]), metadata["uid"], denied)
        if changed is not None:
            raise Outdated(str(changed)) from changed
        return refused

    def _do(self, raw: Object, action: Action) -> None:
        key = (raw["metadata"]["namespace"], raw["metadata"]["name"])
        match action:
            case Create():
                self._create(key, raw["metadata"]["uid"], action.object)
            case Stop():
                self._patch(key, action)
                log.info("stopped", job=key, name=action.job, reason=action.reason)
            case Replace():
                self._replace(key, action)
            case SetSuspend():
                self._patch(key, action)
                log.info("suspended" if action.suspend else "resumed", job=key, name=action.job)
            case Discard(job=name, basis=basis):
                self._writer.delete(JOBS, key[0], name, uid=basis.uid, version=basis.version)
                log.info("deleted", job=key, kind=JOBS.kind, name=name)
            case Delete():
                version = raw["metadata"]["resourceVersion"]
                self._writer.delete(TRAINING_JOBS, *key, uid=action.uid, version=version)
                log.info("deleted", job=key, kind=TRAINING_JOBS.kind, name=key[1])

    def _create(self, key: Key, uid: str, obj: Object) -> None:
        kind, name = obj["kind"], obj["metadata"]["name"]
        try:
            if resource_of(obj) == NETWORK_POLICIES:
                self._writer.apply(obj)
            else:
                self._writer.create(obj)
        except AlreadyExists:
            log.info("exists", job=key, kind=kind, name=name)
            if resource_of(obj) == JOBS:
                self._see_owner(key, uid, obj)
            if resource_of(obj) == CONFIG_MAPS:
                self._see_config_map(key[0], obj)
            return
        log.info("applied", job=key, kind=kind, name=name)

    def _see_owner(self, key: Key, uid: str, obj: Object) -> None:
        """Check that the TrainingJob owns an existing Job that is not in the cache yet.

        Raises:
            AlreadyExists: another object owns the Job, or the Job no longer exists.
        """
        name = obj["metadata"]["name"]
        found = self._strangers.meet(key, uid, name)
        if found is None or not owners(found) & owners(obj):
            words = f"Job {name} already exists, and another object owns it; delete it"
            raise AlreadyExists(HTTPStatus.CONFLICT, "AlreadyExists", words)

    def _see_config_map(self, namespace: str, obj: Object) -> None:
        """Check that an existing ConfigMap is immutable and has the planned data and owner.

        Raises:
            AlreadyExists: the ConfigMap differs in one of these, so pods could train with wrong content.
        """
        name = obj["metadata"]["name"]
        found = self._api.get(CONFIG_MAPS, namespace, name)
        wrong = _wrong_with(found, obj)
        if wrong:
            words = f"ConfigMap {name} already exists {wrong}; delete it"
            raise AlreadyExists(HTTPStatus.CONFLICT, "AlreadyExists", words)

    def _patch(self, key: Key, action: Stop | Replace | SetSuspend) -> None:
        """Patch a Job if its uid and resourceVersion have not changed since the decision."""
        metadata = {**action.patch.get("metadata", {}), "uid": action.basis.uid}
        patch = {**action.patch, "metadata": metadata}
        self._writer.merge(JOBS, key[0], action.job, patch, action.basis.version)

    def _replace(self, key: Key, action: Replace) -> None:
        """Annotate the Job with the replacement, then evict the pod if it still runs.

        Raises:
            ApiError: the annotation was not written, or a disruption budget does not allow an eviction now.
        """
        if not action.marked:
            self._patch(key, action)
        if not action.ended:
            self._writer.evict(key[0], action.pod, action.uid)
        log.info("replaced", job=key, name=action.pod, reason=action.reason)


def _wrong_with(found: Object, planned: Object) -> str:
    """Return the difference between an existing ConfigMap and the planned ConfigMap; "" if they agree."""
    if found.get("data") != planned["data"]:
        return "with other content"
    if not owners(found) & owners(planned):
        return "and does not belong to this job"
    return "" if found.get("immutable") is True else "and is not immutable, so others could change it"
