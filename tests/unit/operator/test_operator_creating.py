"""What is done about an object whose name is taken."""

import pytest

from palaestra.cluster import AlreadyExists
from palaestra.decide import Create
from palaestra.operator.acting import Acting
from palaestra.operator.denials import Denials
from palaestra.operator.writing import Writer

KEY = ("robots", "job")
RAW = {"metadata": {"namespace": "robots", "name": "job", "resourceVersion": "1"}}
WANTED = {
    "apiVersion": "v1",
    "kind": "ConfigMap",
    "metadata": {"name": "job-0-abc", "namespace": "robots"},
    "data": {"training.yaml": "seed: 1"},
}


class Server:
    """An API server that has a ConfigMap of that name already."""

    def __init__(self, data):
        self.there = {"metadata": {"name": "job-0-abc"}, "data": data}

    def get(self, resource, *_):
        """Return the job or the ConfigMap."""
        return RAW if resource.kind == "TrainingJob" else self.there

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
    api, denials = Server(data), Denials()
    acting = Acting(api, Writer(api, lambda: True), None, None, denials)

    refused = acting.carry_out(RAW, (Create(object=WANTED, replica=0),))

    assert (denials.of(KEY), bool(refused)) == (told, bool(told))
