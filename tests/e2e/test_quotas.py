"""Limits of a namespace: if a limit refuses a job's pods, the status shows it until the limit is removed."""

from dataclasses import dataclass, field

import pytest

from tests.e2e.allowances import LIMITED, MISSING, URGENT
from tests.e2e.cluster import Object
from tests.e2e.jobs import LITTLE, tiny_job
from tests.e2e.namespace import LONG_S, Namespace, named

pytestmark = [pytest.mark.after_the_kills, pytest.mark.timeout(1200)]

OF_LIMITED = {"matchExpressions": [{"scopeName": "PriorityClass", "operator": "In", "values": [LIMITED]}]}
PLACE = "palaestra.dev/place"  # an extended resource, of which the node has one unit
IN_PLACE = {"resources": {"requests": {**LITTLE["requests"], PLACE: "1"}, "limits": {PLACE: "1"}}}
WAITS_ONCE = (
    "test -e $PALAESTRA_RUN/seen && exit 0; mkdir -p $PALAESTRA_RUN; touch $PALAESTRA_RUN/seen;"
    " trap 'exit 75' TERM; sleep 3600 & wait"
)


@dataclass(frozen=True)
class Refusal:
    """An object that makes Kubernetes refuse a job's pods, with the message and the job's `scheduling`."""

    kind: str
    spec: Object
    words: str
    scheduling: Object = field(default_factory=dict)

    def begin(self, place: Namespace) -> None:
        """Create the object, so that the namespace refuses the job's pods."""
        place.create(self.kind, {"metadata": {"name": "none"}, "spec": self.spec})

    def end(self, place: Namespace) -> None:
        """Remove the object."""
        place.cluster.delete(self.kind, place.name, "none")


class NoSuchClass(Refusal):
    """A PriorityClass that is missing until `end` creates it."""

    def begin(self, place: Namespace) -> None:
        """Do nothing."""

    def end(self, place: Namespace) -> None:
        """Create the PriorityClass."""
        place.cluster.create(self.kind, priority_class(MISSING))


def priority_class(name: str, preemption: str = "Never") -> Object:
    """Return a PriorityClass above the default; with preemption, it may end other tests' pods."""
    return {
        "metadata": {"name": name},
        "value": 1000,
        "preemptionPolicy": preemption,
        "description": "Made by a test, and taken away.",
    }


def at_least(**quantities: str) -> Object:
    """Return a LimitRange whose containers must request at least these quantities."""
    return {"limits": [{"type": "Container", "min": quantities}]}


def claims_of(most: str) -> Object:
    """Return a LimitRange whose claims may request at most this size."""
    return {"limits": [{"type": "PersistentVolumeClaim", "max": {"storage": most}}]}


REFUSALS = {
    "quota": Refusal("resourcequotas", {"hard": {"pods": "0"}}, "exceeded quota: none"),
    "container": Refusal("limitranges", at_least(cpu="2"), "minimum cpu usage per Container is 2"),
    "claim": Refusal(
        "limitranges", claims_of("1Mi"), "maximum storage usage per PersistentVolumeClaim is 1Mi"
    ),
    "class": NoSuchClass(
        "priorityclasses", {}, f"no PriorityClass with name {MISSING}", {"priorityClassName": MISSING}
    ),
    "limited": Refusal(
        "resourcequotas",
        {"hard": {"pods": "0"}, "scopeSelector": OF_LIMITED},
        "exceeded quota: none",
        {"priorityClassName": LIMITED},
    ),
}


@pytest.fixture(scope="module")
def classes(cluster):
    """Create PriorityClasses; delete them at the end, together with the one that a test creates."""
    cluster.create("priorityclasses", priority_class(LIMITED))
    cluster.create("priorityclasses", priority_class(URGENT, "PreemptLowerPriority"))
    yield
    for name in (MISSING, LIMITED, URGENT):
        cluster.delete("priorityclasses", None, name)


@pytest.fixture(scope="module")
def places(make_namespace, classes):  # noqa: ARG001 - it must exist
    """A namespace with a waiting job for each refusal, so that all jobs wait at the same time."""
    made = {name: make_namespace(f"refuses-{name}") for name in REFUSALS}
    for name, place in made.items():
        REFUSALS[name].begin(place)
        place.apply(tiny_job("waits", script="exit 0", scheduling=REFUSALS[name].scheduling))
    return made


@pytest.fixture(scope="module")
def refused(places):
    """The status of each refused replica, read before the fixture removes the cause of the refusal."""
    told = {name: place.wait_for_reason("waits", "PodsRefused") for name, place in places.items()}
    for name, place in places.items():
        REFUSALS[name].end(place)
    return told


@pytest.fixture
def one_place(cluster):
    """Give a node one unit of an extended resource for which jobs compete, whatever the node's size."""
    node = named(cluster.select("nodes", None)[0])

    def give(amount: str | None) -> None:
        content = {"status": {"capacity": {PLACE: amount}, "allocatable": {PLACE: amount}}}
        cluster.request("PATCH", f"api/v1/nodes/{node}/status", content)

    give("1")
    yield
    give(None)


@pytest.mark.parametrize("name", REFUSALS)
def test_the_status_quotes_the_refusal(name, refused):
    """Without a pod, only events of the Job or responses to the operator contain the cause."""
    assert refused[name]["phase"] == "Pending"
    assert REFUSALS[name].words in refused[name]["message"]
    assert refused[name]["attempt"] == 0


@pytest.mark.usefixtures("classes", "one_place")
def test_a_job_that_the_scheduler_preempts_gets_an_event_and_comes_back(namespace, job):
    """Even without a queue, the scheduler preempts by PriorityClass.

    The job must not count this as a failure.
    """
    namespace.apply(job("everyday", script=WAITS_ONCE, simulator=IN_PLACE, backoffLimit=0))
    namespace.wait_for_pod("everyday")

    urgent = {"priorityClassName": URGENT}
    namespace.apply(job("urgent", script="exit 0", simulator=IN_PLACE, scheduling=urgent))

    assert namespace.wait_for_end("urgent", LONG_S) == "Succeeded"
    assert namespace.wait_for_end("everyday", LONG_S) == "Succeeded"
    assert namespace.replica("everyday")["restarts"]["disruption"] == 1
    assert namespace.replica("everyday")["attempt"] == 2
    (message,) = namespace.events("everyday", "Disrupted")
    assert "preempting to accommodate a higher priority pod" in message


@pytest.mark.parametrize("name", REFUSALS)
@pytest.mark.usefixtures("refused")
def test_a_job_that_was_refused_goes_on_by_itself(name, places):
    """A user need not change the job after the limit is gone, and no failure is counted."""
    place = places[name]

    assert place.wait_for_end("waits", LONG_S) == "Succeeded"
    assert place.replica("waits")["attempt"] == 1
    assert set(place.replica("waits")["restarts"].values()) == {0}
    assert len(place.events("waits", "PodsRefused")) == 1
