"""Conditions that hold after any fault, about the end state, the pods and the owners of a run."""

import threading
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any, Self

from palaestra.cluster import Api, ApiError
from palaestra.cluster.resources import CLAIMS, CONFIG_MAPS, JOBS, NETWORK_POLICIES, PODS, TRAINING_JOBS
from palaestra.plan.replica import JOB_LABEL, REPLICA_LABEL
from tests.integration.operator.cluster import Place

UID_LABEL = "palaestra.dev/job-uid"
MADE = (NETWORK_POLICIES, CONFIG_MAPS, CLAIMS, JOBS)
ENDED = frozenset({"Succeeded", "Failed"})
WATCH_S = 600.0

Object = dict[str, Any]


def end_state(place: Place, changes: Iterable[tuple[str, Object]]) -> dict[str, dict[str, Object]]:
    """Return all objects of a namespace that belong to TrainingJobs, by kind and name.

    The Job controller generates the names of pods, so a pod is named by its replica and a number. The numbers
    follow the order of a watch, because two pods may have the same creation time in whole seconds.
    """
    state = {
        resource.kind: {each["metadata"]["name"]: each for each in place.all(resource)}
        for resource in (TRAINING_JOBS, *MADE)
    }
    state["Pod"] = dict(_numbered(place.all(PODS), changes))
    state["ConfigMap"].pop("kube-root-ca.crt", None)
    return state


def _numbered(pods: Iterable[Object], changes: Iterable[tuple[str, Object]]) -> Iterator[tuple[str, Object]]:
    counts: Counter[str] = Counter()
    uids = dict.fromkeys(pod["metadata"]["uid"] for _, pod in changes)
    came = {uid: number for number, uid in enumerate(uids)}
    for pod in sorted(pods, key=lambda each: came.get(each["metadata"]["uid"], len(came))):
        replica = "-".join(_replica(pod)[1:])
        counts[replica] += 1
        yield f"{replica}#{counts[replica]}", pod


def orphans(state: Mapping[str, Mapping[str, Object]]) -> list[str]:
    """Return the orphans: objects whose TrainingJob or owner no longer exists.

    Two kinds of objects are excluded. A claim outlives its TrainingJob, because it holds the run. A pod that
    is being deleted waits for its kubelet.
    """
    living = {each["metadata"]["uid"] for kind in state.values() for each in kind.values()}
    return [
        f"{kind} {name} is left behind"
        for kind, objects in state.items()
        for name, each in objects.items()
        if not _may_stay(kind, each["metadata"]) and not _belonging(each["metadata"]) <= living
    ]


def _may_stay(kind: str, metadata: Mapping[str, Any]) -> bool:
    return kind == "PersistentVolumeClaim" or (kind == "Pod" and "deletionTimestamp" in metadata)


def _belonging(metadata: Mapping[str, Any]) -> set[str]:
    owners = {owner["uid"] for owner in metadata.get("ownerReferences", ())}
    label = metadata.get("labels", {}).get(UID_LABEL)
    return owners | ({label} if label else set())


def doubles(changes: Iterable[tuple[str, Object]]) -> list[str]:
    """Return the replicas that had two pods at the same time, according to the events of a watch."""
    alive: dict[tuple[str, ...], set[str]] = defaultdict(set)
    found = []
    for kind, pod in changes:
        replica, uid = _replica(pod), pod["metadata"]["uid"]
        gone = kind == "DELETED" or pod.get("status", {}).get("phase") in ENDED
        if gone:
            alive[replica].discard(uid)
        else:
            alive[replica].add(uid)
        if len(alive[replica]) > 1:
            found.append(f"replica {'-'.join(replica[1:])} has {len(alive[replica])} pods at once")
    return sorted(set(found))


def _replica(pod: Object) -> tuple[str, str, str]:
    """Return uid and name of a pod's TrainingJob, and the replica's index."""
    labels = pod["metadata"].get("labels", {})
    return labels.get(UID_LABEL, ""), labels.get(JOB_LABEL, ""), labels.get(REPLICA_LABEL, "")


class PodWatch:
    """Records all events of a namespace's pods during a `with` block."""

    def __init__(self, api: Api, namespace: str) -> None:
        self._api = api
        self._namespace = namespace
        version = next(iter(api.pages(PODS, namespace))).version
        self._watch = api.watch(PODS, namespace, version=version, seconds=WATCH_S)
        self._changes: list[tuple[str, Object]] = []
        self._thread = threading.Thread(target=self._run, daemon=True)

    def changes(self) -> list[tuple[str, Object]]:
        """Return the events so far: the type of each event, and the pod."""
        return list(self._changes)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._watch.close()
        self._thread.join()

    def _run(self) -> None:
        with suppress(ApiError):
            for event in self._watch:
                if event["type"] != "BOOKMARK":
                    self._changes.append((event["type"], event["object"]))
