"""What is done about an object whose name is taken."""

import pytest

from palaestra.cluster import AlreadyExists, NotFound
from palaestra.decide import Create
from palaestra.operator.acting import Acting
from palaestra.operator.denials import Denials
from palaestra.operator.strangers import Strangers
from palaestra.operator.writing import Writer

KEY = ("robots", "job")
RAW = {"metadata": {"namespace": "robots", "name": "job", "resourceVersion": "1"}}
WANTED = {
    "apiVersion": "v1",
    "kind": "ConfigMap",
    "metadata": {"name": "job-0-abc", "namespace": "robots"},
    "data": {"training.yaml": "seed: 1"},
}


def a_job(*owners):
    """Return the Job of a replica, with the uids of its owners."""
    metadata = {"name": "job-0", "namespace": "robots", "ownerReferences": [{"uid": uid} for uid in owners]}
    return {"apiVersion": "batch/v1", "kind": "Job", "metadata": metadata}


class Server:
    """An API server that has an object of that name already."""

    def __init__(self, there):
        self.there = there

    def get(self, resource, *_):
        """Return the TrainingJob, or what is there."""
        if resource.kind == "TrainingJob":
            return RAW
        if self.there is None:
            raise NotFound(404, "NotFound", "it is gone")
        return self.there

    def list(self, *_, **__):
        """Return no pods."""
        return []

    def create(self, *_):
        """Refuse."""
        raise AlreadyExists(409, "AlreadyExists", "it is there")


@pytest.mark.parametrize(
    ("data", "told"),
    [
        ({"training.yaml": "seed: 1"}, {}),
        (
            {"training.yaml": "seed: 2"},
            {0: "ConfigMap job-0-abc is there already, with other content; delete it"},
        ),
    ],
    ids=["ours, of a moment ago", "of somebody else"],
)
def test_a_config_map_that_is_there_already_is_used_only_with_our_content(data, told):
    """Pods would train whatever it says."""
    api, denials = Server({"metadata": {"name": "job-0-abc"}, "data": data}), Denials()
    acting = Acting(api, Writer(api, lambda: True), None, None, denials)

    refused = acting.carry_out(RAW, (Create(object=WANTED, replica=0),))

    assert (denials.of(KEY), bool(refused)) == (told, bool(told))


@pytest.mark.parametrize(
    ("there", "made"),
    [(a_job("ours"), True), (a_job("theirs"), False), (a_job(), False), (None, False)],
    ids=["ours, which the cache has not heard of", "of an earlier job", "of nobody", "gone by now"],
)
def test_a_job_that_is_there_already_is_taken_for_made_only_if_it_is_ours(there, made):
    """Else an event would say that it was created; whose the name is, the next look tells."""
    api = Server(there)
    acting = Acting(api, Writer(api, lambda: True), None, Strangers(api), Denials())

    refused = acting.carry_out(RAW, (Create(object=a_job("ours"), replica=0),))

    assert (not refused) is made
