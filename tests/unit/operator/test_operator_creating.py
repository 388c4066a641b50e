"""The operator tries to create an object whose name is already in use."""

import pytest

from palaestra.cluster import AlreadyExists, NotFound
from palaestra.decide import Create
from palaestra.operator.executor import Executor
from palaestra.operator.fenced_client import FencedClient
from palaestra.operator.preconditions import Outdated
from palaestra.operator.unwatched_facts import ForeignJobs, RejectedCreations

KEY = ("robots", "job")
RAW = {"metadata": {"namespace": "robots", "name": "job", "uid": "u", "resourceVersion": "1"}}
WANTED = {
    "apiVersion": "v1",
    "kind": "ConfigMap",
    "metadata": {"name": "job-0-abc", "namespace": "robots", "ownerReferences": [{"uid": "ours"}]},
    "immutable": True,
    "data": {"training.yaml": "seed: 1"},
}


def a_job(*owners):
    """Return the Job of a replica whose owners have these uids."""
    metadata = {"name": "job-0", "namespace": "robots", "ownerReferences": [{"uid": uid} for uid in owners]}
    return {"apiVersion": "batch/v1", "kind": "Job", "metadata": metadata}


class Server:
    """An API server that already has an object of this name."""

    pods = ()

    def __init__(self, there):
        self.there = there

    def get(self, resource, *_):
        """Return the TrainingJob, or the existing object."""
        if resource.kind == "TrainingJob":
            return RAW
        if self.there is None:
            raise NotFound(404, "NotFound", "it is gone")
        return self.there

    def list(self, *_, **__):
        """Return the pods."""
        return list(self.pods)

    def create(self, *_):
        """Refuse the creation."""
        raise AlreadyExists(409, "AlreadyExists", "it is there")


@pytest.mark.parametrize(
    ("change", "wrong"),
    [
        ({}, None),
        ({"data": {"training.yaml": "seed: 2"}}, "with other content"),
        ({"metadata": {"name": "job-0-abc"}}, "and does not belong to this job"),
        ({"immutable": False}, "and is not immutable, so others could change it"),
    ],
    ids=["ours, of a moment ago", "other content", "of somebody else", "not immutable"],
)
def test_a_config_map_that_is_there_already_is_used_only_if_it_is_ours_for_good(change, wrong):
    """Pods must not train with the content of a foreign ConfigMap, or of one that somebody can change."""
    api, denials = Server({**WANTED, **change}), RejectedCreations()
    acting = Executor(api, FencedClient(api, lambda: True), None, denials)

    refused = acting.carry_out(RAW, (Create(object=WANTED, replica=0),))

    told = {} if wrong is None else {0: f"ConfigMap job-0-abc already exists {wrong}; delete it"}
    assert (denials.known(KEY, "u"), bool(refused)) == (told, bool(told))


@pytest.mark.parametrize(
    ("there", "made"),
    [(a_job("ours"), True), (a_job("theirs"), False), (a_job(), False), (None, False)],
    ids=["ours, which the cache has not heard of", "of an earlier job", "of nobody", "gone by now"],
)
def test_a_job_that_is_there_already_is_taken_for_made_only_if_it_is_ours(there, made):
    """An event must not report the creation of a foreign Job.

    The next reconcile finds out to whom the Job belongs.
    """
    api = Server(there)
    acting = Executor(api, FencedClient(api, lambda: True), ForeignJobs(api), RejectedCreations())

    refused = acting.carry_out(RAW, (Create(object=a_job("ours"), replica=0),))

    assert (not refused) is made


def a_pod(uid="old", claim="shared", phase="Running"):
    """Return a pod of replica 0 of the TrainingJob with this uid."""
    labels = {"palaestra.dev/job": "job", "palaestra.dev/job-uid": uid, "palaestra.dev/replica": "0"}
    volumes = [{"name": "run", "persistentVolumeClaim": {"claimName": claim}}]
    metadata = {"name": "job-0-x", "labels": labels}
    return {"metadata": metadata, "spec": {"volumes": volumes}, "status": {"phase": phase}}


@pytest.mark.parametrize(
    ("pod", "waits"),
    [
        (a_pod(), True),
        (a_pod(claim="job-0-old"), False),
        (a_pod(uid="new", claim="other"), True),
        (a_pod(phase="Failed"), False),
    ],
    ids=["an earlier one's, on a claim of both", "an earlier one's", "its own", "one that has ended"],
)
def test_a_job_is_not_created_beside_a_pod_that_may_write_to_its_volume(pod, waits):
    """The cache may be outdated, so the operator reads the pods from the API server before the creation."""
    job = a_job("ours")
    job["metadata"]["labels"] = a_pod(uid="new")["metadata"]["labels"]
    job["spec"] = {"template": {"spec": a_pod()["spec"]}}
    api = Server(job)
    api.pods = [pod]
    acting = Executor(api, FencedClient(api, lambda: True), ForeignJobs(api), RejectedCreations())

    try:
        acting.carry_out(RAW, (Create(object=job, replica=0),))
        waited = False
    except Outdated:
        waited = True

    assert waited is waits
