"""Do what was decided: create what is missing, stop, suspend, resume, delete.

Names make it safe to do anything twice: what is there already is refused by the API server. One action
that fails keeps no other replica from its own.
"""

from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

import structlog

from palaestra.cluster import AlreadyExists, Api, ApiError, NotFound
from palaestra.cluster.resources import CONFIG_MAPS, JOBS, NETWORK_POLICIES, PODS, TRAINING_JOBS, of
from palaestra.decide import Action, Create, Delete, SetSuspend, Stop
from palaestra.errors import PalaestraError
from palaestra.observe.reading import owners
from palaestra.operator.caches import Caches
from palaestra.operator.denials import Denials, Denied
from palaestra.operator.poller import Key
from palaestra.operator.strangers import Strangers
from palaestra.operator.writing import Writer
from palaestra.plan.replica import JOB_LABEL, REPLICA_LABEL

log = structlog.get_logger(__name__)

Object = Mapping[str, Any]


class Outdated(PalaestraError):
    """The cache was behind the cluster, so nothing was created; look again when it has caught up."""


class Acting:
    """Carries out actions.

    Args:
        api: to read what no cache may be believed about.
        writer: to write.
        caches: whose Jobs are patched.
        strangers: told of Jobs whose names are taken.
        denials: told what could not be created.
    """

    def __init__(
        self, api: Api, writer: Writer, caches: Caches, strangers: Strangers, denials: Denials
    ) -> None:
        self._api = api
        self._writer = writer
        self._caches = caches
        self._strangers = strangers
        self._denials = denials

    def carry_out(self, raw: Object, actions: tuple[Action, ...]) -> Denied:
        """Do `actions` for a TrainingJob, in order, and return what was refused; empty if all was done.

        After a refusal nothing more is done for that replica, and nothing more is created at all if it
        was about the whole job: no pod runs without its network policy.

        Raises:
            Outdated: something is to be created, and the job is not as it was when this was decided.
            NotLeading: another operator may lead.
        """
        self._confirm(raw, [each for each in actions if isinstance(each, Create)])
        refused: dict[int | None, ApiError] = {}
        denied: dict[int | None, ApiError] = {}
        for action in actions:
            replica = None if isinstance(action, Delete) else action.replica
            if replica in refused or (None in refused and isinstance(action, Create)):
                continue
            try:
                self._do(raw, action)
            except ApiError as error:
                refused[replica] = error
                if isinstance(action, Create):
                    denied[replica] = error
        self._denials.learn((raw["metadata"]["namespace"], raw["metadata"]["name"]), denied)
        return refused

    def _confirm(self, raw: Object, creations: list[Create]) -> None:
        """See that the cluster is as the caches say, before anything is created.

        A replica that has ended is never trained again, and none ever has two pods.
        """
        if not creations:
            return
        namespace, name = raw["metadata"]["namespace"], raw["metadata"]["name"]
        try:
            found = self._api.get(TRAINING_JOBS, namespace, name)["metadata"]["resourceVersion"]
        except NotFound:
            found = None
        begun = {str(each.replica) for each in creations if of(each.object) == JOBS}
        pods = self._api.list(PODS, namespace, labels=f"{JOB_LABEL}={name}") if begun else []
        if found != raw["metadata"]["resourceVersion"] or any(_occupies(pod, begun) for pod in pods):
            raise Outdated("the caches are behind the cluster; nothing was created")

    def _do(self, raw: Object, action: Action) -> None:
        key = (raw["metadata"]["namespace"], raw["metadata"]["name"])
        match action:
            case Create():
                self._create(key, action.object)
            case Stop():
                self._patch(key, action.job, action.patch)
                log.info("stopped", job=key, name=action.job, reason=action.reason)
            case SetSuspend():
                self._patch(key, action.job, action.patch)
                log.info("suspended" if action.suspend else "resumed", job=key, name=action.job)
            case Delete():
                self._delete(key, action)

    def _create(self, key: Key, obj: Object) -> None:
        kind, name = obj["kind"], obj["metadata"]["name"]
        try:
            if of(obj) == NETWORK_POLICIES:
                self._writer.apply(obj)
            else:
                self._writer.create(obj)
        except AlreadyExists:
            log.info("exists", job=key, kind=kind, name=name)
            if of(obj) == JOBS:
                self._see_owner(key, obj)
            if of(obj) == CONFIG_MAPS:
                self._see_content(key[0], obj)
            return
        log.info("applied", job=key, kind=kind, name=name)

    def _see_owner(self, key: Key, obj: Object) -> None:
        """See that a Job that is there is the TrainingJob's own, of which the cache has not heard yet.

        Raises:
            AlreadyExists: it is not, or is gone by now.
        """
        name = obj["metadata"]["name"]
        found = self._strangers.meet(key, name)
        if found is None or not owners(found) & owners(obj):
            words = f"Job {name} is there already, and is not this job's; delete it"
            raise AlreadyExists(HTTPStatus.CONFLICT, "AlreadyExists", words)

    def _see_content(self, namespace: str, obj: Object) -> None:
        """See that a ConfigMap that is there holds what it should: pods would train whatever it says.

        Raises:
            AlreadyExists: it does not.
        """
        name = obj["metadata"]["name"]
        if self._api.get(CONFIG_MAPS, namespace, name).get("data") != obj["data"]:
            words = f"ConfigMap {name} is there already, with other content; delete it"
            raise AlreadyExists(HTTPStatus.CONFLICT, "AlreadyExists", words)

    def _patch(self, key: Key, name: str, patch: Object) -> None:
        """Change a Job, if it is the one that was decided about."""
        found = self._caches.job(key[0], name)
        if found is not None:
            metadata = {**patch.get("metadata", {}), "uid": found["metadata"]["uid"]}
            self._writer.merge(JOBS, key[0], name, {**patch, "metadata": metadata})

    def _delete(self, key: Key, action: Delete) -> None:
        try:
            self._writer.delete(TRAINING_JOBS, *key, action.uid)
        except NotFound:
            return
        log.info("deleted", job=key)


def _occupies(pod: Object, replicas: set[str]) -> bool:
    """Return whether a pod of one of these replicas may still write to its volume."""
    ended = (pod.get("status") or {}).get("phase") in {"Succeeded", "Failed"}
    return not ended and pod["metadata"]["labels"].get(REPLICA_LABEL) in replicas
