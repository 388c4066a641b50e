"""Scripts of workloads: actions of people, kubelets and queues while the operator meets a fault.

A script waits for states of the cluster, and no job trains at its end.
"""

from collections.abc import Callable
from contextlib import suppress
from datetime import UTC, datetime
from typing import Any, Self

from palaestra.cluster import Api, ApiError
from palaestra.cluster.resources import CONFIG_MAPS, JOBS, NAMESPACES, PODS, TRAINING_JOBS
from palaestra_protocol.pod.status import Termination
from tests.faults.course import Course
from tests.faults.trainers import Trainer
from tests.integration.operator.cluster import Place, world_map, world_of
from tests.waiting import eventually

PATIENCE_S = 90.0  # after a fault, the operator may retry a job only after half a minute
DONE = Termination(step=20, reason="Completed", success_rate=0.9)
SAVED = Termination(step=20, reason="Interrupted: SIGTERM received")
BUDGET_SPENT, INTERRUPTED = 80, 75
# The times in Kubernetes are whole seconds, so the order of two actions within one second is unknown.
DISTINCT_S = 3.0
NOBODY = "127.0.0.1"  # an address at which no trainer listens

Object = dict[str, Any]


class Stage(Place):
    """A namespace for a script, with a kubelet and trainers; it exists until the block ends.

    Args:
        api: an administrator's client.
        course: names the fault of the trainers.
    """

    def __init__(self, api: Api, course: Course) -> None:
        super().__init__(api)
        self._course = course
        self._trainers: list[Trainer] = []

    def trainer(self, *, honest: bool = True) -> Trainer:
        """Return a new trainer; unless it is `honest`, it responds with the fault of the plan."""
        self._trainers.append(Trainer(None if honest else self._course))
        return self._trainers[-1]

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        for each in self._trainers:
            each.close()
        with suppress(ApiError):  # a namespace that is not deleted costs later runs only some memory
            self.api.delete(NAMESPACES, None, self.name)


Script = Callable[[Stage], None]


def ends(place: Stage) -> None:
    """Four jobs: one succeeds, one fails, one has an invalid spec, and one gets its world late."""
    place.train("good", replicas=2)
    place.train("bad")
    place.train("wrong", trainer={"algorithm": {"name": "SAC"}})
    place.train("late", **world_of("world"))
    good, bad = _running(place, "good", 2), _running(place, "bad")
    eventually(lambda: place.condition("Accepted", "late").get("reason") == "WorldMissing", PATIENCE_S)
    place.create(CONFIG_MAPS, world_map())
    late = _running(place, "late")
    for pod in [*good, *late]:
        place.end(pod, word=DONE)
    place.end(*bad, code=BUDGET_SPENT)
    for name in ("good", "late"):
        place.until("Succeeded", name, PATIENCE_S)
    for name in ("bad", "wrong"):
        place.until("Failed", name, PATIENCE_S)


def pauses(place: Stage) -> None:
    """One job is suspended before its pod runs, resumed, suspended while it runs, resumed, and succeeds."""
    place.train("paused", suspend=True)
    place.train("beside")
    place.until("Suspended", "paused", PATIENCE_S)
    eventually(lambda: place.get(JOBS, "paused-0"), PATIENCE_S)
    _suspend(place, "paused", flag=False)
    [pod] = _running(place, "paused")
    _suspend(place, "paused", flag=True)
    place.until("Suspended", "paused", PATIENCE_S)
    eventually(lambda: place.get(PODS, pod["metadata"]["name"]) is None, PATIENCE_S)
    _suspend(place, "paused", flag=False)
    for name in ("paused", "beside"):
        _succeed(place, name)


def again(place: Stage) -> None:
    """One job, on a lost node, is deleted and created again; the Job of another job is deleted."""
    place.train("again")
    place.train("robbed")
    [lost] = place.pods("again", 1, PATIENCE_S)
    place.bind(lost)
    _running(place, "again")
    place.api.delete(TRAINING_JOBS, place.name, "again")
    eventually(lambda: all(each.startswith("PersistentV") for each in place.children("again")), PATIENCE_S)
    place.train("again")
    [robbed] = _running(place, "robbed")
    place.api.delete(JOBS, place.name, "robbed-0")
    eventually(lambda: _others(place, "robbed", robbed), PATIENCE_S)
    for name in ("again", "robbed"):
        _succeed(place, name)
    place.end(lost, INTERRUPTED)


def deadlines(place: Stage) -> None:
    """One job gets a deadline while it runs and exceeds it; another is deleted a second after its end."""
    place.train("slow")
    place.train("brief", ttlSecondsAfterFinished=1)
    _running(place, "slow")
    place.api.merge(TRAINING_JOBS, place.name, "slow", {"spec": {"activeDeadlineSeconds": 1}})
    _succeed_at_once(place, "brief")
    place.until("Failed", "slow", PATIENCE_S)
    eventually(lambda: place.get(TRAINING_JOBS, "brief") is None, PATIENCE_S)
    eventually(lambda: all(each.startswith("PersistentV") for each in place.children("brief")), PATIENCE_S)


def evictions(place: Stage) -> None:
    """A pod is evicted, and the next pod, which the Job controller creates after 10 s, resumes."""
    place.train("taken", backoffLimit=0)
    [pod] = _running(place, "taken")
    place.take(pod, "EvictionByEvictionAPI", "Eviction API: evicting")
    place.end(pod, INTERRUPTED, SAVED)
    eventually(lambda: _others(place, "taken", pod), PATIENCE_S)
    _succeed(place, "taken")


def queues(place: Stage) -> None:
    """A queue admits a job, preempts it and admits it again.

    It does the same with a job that does not name the queue.
    """
    place.train("queued", scheduling={"queueName": "robots"})
    place.train("seized")
    place.until("Suspended", "queued", PATIENCE_S)
    eventually(lambda: place.get(JOBS, "queued-0"), PATIENCE_S)
    _admit(place, "queued-0", flag=True)
    pods = {name: _running(place, name)[0] for name in ("queued", "seized")}
    for name, pod in pods.items():
        eventually(lambda pod=pod: _age_s(pod) > DISTINCT_S, PATIENCE_S)
        _admit(place, f"{name}-0", flag=False)
    for name, pod in pods.items():
        place.until("Suspended", name, PATIENCE_S)
        eventually(lambda pod=pod: _age_s(pod) > 2 * DISTINCT_S, PATIENCE_S)
        _admit(place, f"{name}-0", flag=True)
    for name in pods:
        _succeed(place, name)


def trainers(place: Stage) -> None:
    """Two jobs train at the same time, and the operator polls both for their progress."""
    honest, other = place.trainer(), place.trainer(honest=False)
    place.train("honest")
    place.train("other")
    pods = [*_running(place, "honest", at=honest.host), *_running(place, "other", at=other.host)]
    eventually(lambda: len(other.asked) > 1, PATIENCE_S)
    asked = len(honest.asked)
    eventually(lambda: len(honest.asked) > asked, PATIENCE_S)
    for pod in pods:
        place.end(pod, word=DONE)
    for name in ("honest", "other"):
        place.until("Succeeded", name, PATIENCE_S)


WORKLOADS: dict[str, Script] = {
    "ends": ends,
    "pauses": pauses,
    "again": again,
    "deadlines": deadlines,
    "evictions": evictions,
    "queues": queues,
    "trainers": trainers,
}


def _running(place: Stage, name: str, count: int = 1, at: str = NOBODY) -> list[Object]:
    """Let the pods of a job run; return them when the job's status is Running."""
    pods = place.pods(name, count, PATIENCE_S)
    for pod in pods:
        place.run(pod, at)
    place.until("Running", name, PATIENCE_S)
    return pods


def _succeed(place: Stage, name: str) -> None:
    for pod in _running(place, name):
        place.end(pod, word=DONE)
    place.until("Succeeded", name, PATIENCE_S)


def _succeed_at_once(place: Stage, name: str) -> None:
    """Let a job succeed and return at once, because the job may be deleted before its status is set."""
    for pod in place.pods(name, 1, PATIENCE_S):
        place.run(pod)
        place.end(pod, word=DONE)


def _suspend(place: Stage, name: str, *, flag: bool) -> None:
    place.api.merge(TRAINING_JOBS, place.name, name, {"spec": {"suspend": flag}})


def _admit(place: Stage, name: str, *, flag: bool) -> None:
    place.api.merge(JOBS, place.name, name, {"spec": {"suspend": not flag}})


def _age_s(pod: Object) -> float:
    created = datetime.fromisoformat(pod["metadata"]["creationTimestamp"])
    return (datetime.now(UTC) - created).total_seconds()


def _others(place: Stage, name: str, pod: Object) -> list[Object]:
    """Return the pods of a job that have not ended, except `pod`."""
    return [
        each for each in place.pods(name, 1, PATIENCE_S) if each["metadata"]["uid"] != pod["metadata"]["uid"]
    ]
