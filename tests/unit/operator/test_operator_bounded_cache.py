"""A bounded cache holds the facts about TrainingJobs that no watch delivers, by TrainingJob."""

import pytest

from palaestra.cluster import Forbidden
from palaestra.decide import accept
from palaestra.operator.bounded_cache import REMEMBERED, BoundedCache
from palaestra.operator.observer import JobObserver
from palaestra.operator.unwatched_facts import ForeignJobs, RejectedCreations
from palaestra.operator.world_verdicts import WorldChecker
from tests.jobs import make_job

KEY, UID = ("robots", "job"), "u"
OTHER = ("robots", "other")
WORLD = {"inline": '#VRML_SIM R2023b utf8\nRobot { name "robotino" controller "ros" }\n'}
TRAINING_JOB = make_job(
    metadata={"namespace": "robots", "uid": UID, "generation": 1},
    suspend=True,
    simulators=[
        {"name": "collect", "role": "Collect", "world": WORLD},
        {"name": "evaluate", "role": "Evaluate", "world": WORLD},
    ],
)


@pytest.fixture
def full():
    """Return a cache that another TrainingJob has filled up."""
    memory = BoundedCache()
    memory.keep(OTHER, UID, dict.fromkeys(range(REMEMBERED), "words"))
    return memory


def test_what_a_look_leaves_takes_the_place_of_what_was_known():
    """A reconcile replaces the facts of its job, so outdated facts need no cleanup."""
    memory = BoundedCache()
    memory.keep(KEY, UID, {"a": 1, "b": 2})

    memory.keep(KEY, UID, {"b": 3})

    assert memory.known(KEY, UID) == {"b": 3}


def test_nothing_is_known_of_a_job_that_was_made_again():
    """The new job has the name of the old one but another uid, so the old facts do not apply."""
    memory = BoundedCache()
    memory.keep(KEY, UID, {"a": 1})

    assert memory.known(KEY, "another") == {}
    assert memory.known(KEY, UID) == {}, "the one before is gone for good"


def test_a_full_memory_takes_nothing_new_and_keeps_what_it_has(full):
    """A new fact must not evict an old one.

    Otherwise, with more jobs than the limit, each fact would be gone before the next reconcile of its job.
    """
    assert full.keep(KEY, UID, {"a": 1}) == {}

    assert full.known(KEY, UID) == {}
    assert len(full.known(OTHER, UID)) == REMEMBERED


def test_what_is_known_keeps_its_place_when_a_job_brings_more_than_there_is_room_for(full):
    """A new fact that comes first in the dict must not displace a known fact."""
    full.keep(OTHER, UID, dict.fromkeys(range(REMEMBERED - 1), "words"))

    kept = full.keep(OTHER, UID, {"new": "a", "newer": "b", **dict.fromkeys(range(REMEMBERED - 1), "words")})

    assert kept.keys() == {"new", *range(REMEMBERED - 1)}


def test_what_is_forgotten_makes_room(full):
    """The facts of a deleted TrainingJob must not use space in the cache."""
    full.forget(OTHER)

    assert full.keep(KEY, UID, {"a": 1}) == {"a": 1}
    assert full.known(OTHER, UID) == {}


class Cluster:
    """An API server and the caches with one Job. Another program has resumed the Job; its pod is missing."""

    def __init__(self):
        self.asked = 0

    def get(self, *_):
        """Return the Job with its managedFields."""
        self.asked += 1
        return self.children(None, KEY)[0]

    def children(self, resource, _):
        """Return the Job, or an empty list for another kind."""
        if resource is not None and resource.kind != "Job":
            return []
        metadata = {
            "name": "job-0", "namespace": "robots", "uid": "j", "generation": 2,
            "ownerReferences": [{"uid": UID}], "annotations": {"palaestra.dev/suspend-set": "true"},
        }  # fmt: skip
        return [{"kind": "Job", "metadata": metadata, "spec": {"suspend": False}, "status": {}}]


def test_nothing_stays_of_a_job_that_is_gone():
    """The operator drops all facts of a deleted job, so its memory does not grow with deleted jobs."""
    cluster, strangers, denials = Cluster(), ForeignJobs(Cluster()), RejectedCreations()
    checking = WorldChecker(dict, print)
    looking = JobObserver(cluster, cluster, strangers, denials, dict, checking)
    job = accept(TRAINING_JOB)
    denials.learn(KEY, UID, {0: Forbidden(403, "Forbidden", "exceeded quota")})
    strangers.meet(KEY, UID, "job-1")
    for _ in range(2):
        looking.look(job)
    assert cluster.asked == 1, "the manager that resumed the Job is read once for each change"

    looking.forget(KEY)

    assert (denials.known(KEY, UID), strangers.known(KEY, UID)) == ({}, {})
    looking.look(job)
    assert cluster.asked == 2
