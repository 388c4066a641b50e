"""The status of a queued job shows why it waits, with a real API server; the test acts as Kueue."""

from dataclasses import replace

import pytest

from palaestra.api.reason_texts import LONGEST_FACT
from palaestra.cluster import NotFound, Resource
from palaestra.cluster.resources import DEFINITIONS, JOBS, RIGHTS, WORKLOADS
from palaestra.observe.kueue import NO_WORKLOAD
from palaestra.operator.options import NAME
from tests.integration.operator.cluster import kind_of_kueue, local_queues
from tests.integration.operator.installed import USER
from tests.waiting import eventually

GROUP = "kueue.x-k8s.io"
ROLES = Resource(
    api_version="rbac.authorization.k8s.io/v1", kind="ClusterRole", plural="clusterroles", namespaced=False
)
QUEUE = {"queueName": "trainings"}
WAITS = "waits in queue trainings for Kueue"
SHORT = "couldn't assign flavors to pod set main: insufficient unused quota for cpu, 425m more needed"


def playing(installed, version):
    """Serve kinds of Kueue until the fixture ends, with Workloads in this version."""
    kinds = (local_queues(), kind_of_kueue("Workload", version))
    for each in kinds:
        installed.create(DEFINITIONS, each)
    workloads = replace(WORKLOADS, api_version=f"{GROUP}/{version}")
    eventually(lambda: installed.serves(GROUP) and there(installed, workloads))
    yield
    for each in kinds:
        installed.delete(DEFINITIONS, None, each["metadata"]["name"])
    eventually(lambda: not installed.serves(GROUP))


def there(api, resource):
    """Return whether the API server serves a kind already."""
    try:
        api.list(resource)
    except NotFound:
        return False
    return True


@pytest.fixture
def kueue(installed):
    """Make the cluster look as if it had Kueue with its Workloads."""
    yield from playing(installed, "v1beta2")


@pytest.fixture
def old_kueue(installed):
    """Make the cluster look as if it had an older Kueue with another version of Workloads."""
    yield from playing(installed, "v1beta1")


@pytest.fixture
def old_role(installed):
    """Remove Workloads from the operator's role, as in a role of an earlier release."""
    rules = installed.get(ROLES, None, NAME)["rules"]
    others = [each for each in rules if each["apiGroups"] != [GROUP]]
    installed.merge(ROLES, None, NAME, {"rules": others})
    eventually(lambda: not allowed(installed))
    yield
    installed.merge(ROLES, None, NAME, {"rules": rules})
    eventually(lambda: allowed(installed))


def allowed(api):
    """Return whether the operator may list Workloads by now."""
    asked = {"group": GROUP, "resource": "workloads", "verb": "list", "namespace": "default"}
    review = {"apiVersion": RIGHTS.api_version, "kind": RIGHTS.kind, "metadata": {}}
    return api.create(RIGHTS, {**review, "spec": {"user": USER, "resourceAttributes": asked}})["status"][
        "allowed"
    ]


def job_in_queue(place):
    """Create a TrainingJob with a queue, and return its Job; the Job waits in the queue."""
    place.train(scheduling=QUEUE)
    return eventually(lambda: place.get(JOBS, "job-0"))


def not_admitted(place, job, message):
    """Create a Workload with Kueue's reason why a Job is not admitted."""
    reserved = {"type": "QuotaReserved", "status": "False", "reason": "Pending", "message": message}
    metadata = {
        "name": "job-job-0-1a2b3",
        "namespace": place.name,
        "labels": {f"{GROUP}/job-uid": job["metadata"]["uid"]},
    }
    obj = {"apiVersion": WORKLOADS.api_version, "kind": WORKLOADS.kind, "metadata": metadata}
    place.create(WORKLOADS, {**obj, "spec": {"active": True}, "status": {"conditions": [reserved]}})


def message(place):
    """Return the message in the status of the first replica."""
    return (place.status().get("replicas") or [{}])[0].get("message", "")


def lists(control_plane, place):
    """Return the HTTP codes of the operator's requests for Workloads."""
    wanted = {"resource": "workloads", "namespace": place.name}
    return [
        each["responseStatus"]["code"]
        for each in control_plane.audit(place.name)
        if each["user"].get("username") == USER and wanted.items() <= each.get("objectRef", {}).items()
    ]


@pytest.mark.usefixtures("kueue")
def test_the_words_of_kueue_are_in_the_status(place, start):
    """An author who cannot read Workloads finds the reason in the TrainingJob."""
    start()
    not_admitted(place, job_in_queue(place), SHORT + "x" * LONGEST_FACT)

    eventually(lambda: message(place).startswith(f"{WAITS}: {SHORT}"), 60)

    assert place.status()["replicas"][0]["reason"] == "Queued"
    assert place.condition("Suspended")["message"] == message(place)
    assert len(message(place)) < 2 * LONGEST_FACT


@pytest.mark.usefixtures("kueue")
def test_a_job_of_which_kueue_makes_no_workload_says_what_to_check(place, start):
    """The namespace may lack a label that Kueue requires, and no object in the cluster shows this cause."""
    start()
    job_in_queue(place)

    assert eventually(lambda: message(place) == f"{WAITS}: {NO_WORKLOAD}", 60)


@pytest.mark.usefixtures("kueue")
def test_a_job_that_is_admitted_is_asked_about_no_more(place, start, control_plane):
    """An idle operator must send no requests while no job waits in a queue."""
    start()
    job_in_queue(place)
    eventually(lambda: lists(control_plane, place), 60)
    place.api.merge(JOBS, place.name, "job-0", {"spec": {"suspend": False}})
    [pod] = place.pods()
    place.run(pod)
    place.until("Running")
    before = len(lists(control_plane, place))

    place.train("later", suspend=True)  # its author suspends it, and it is in no queue
    place.until("Suspended", "later")

    assert len(lists(control_plane, place)) == before


@pytest.mark.usefixtures("old_kueue")
def test_a_kueue_that_does_not_serve_this_version_disturbs_nothing(place, start, control_plane):
    """Without Kueue's message, the status must still show that the job waits in the queue."""
    operator = start()
    job_in_queue(place)
    eventually(lambda: lists(control_plane, place), 60)
    place.train("later", scheduling=QUEUE)  # shows that the operator continues
    place.until("Suspended", "later")

    assert set(lists(control_plane, place)) == {404}
    assert message(place) == WAITS
    assert operator.said("refused") == operator.said("not reconciled") == []


@pytest.mark.usefixtures("kueue", "old_role")
def test_a_role_without_workloads_disturbs_nothing(place, start, control_plane):
    """After an upgrade, an operator may still have the role of the earlier release."""
    operator = start()
    not_admitted(place, job_in_queue(place), SHORT)
    eventually(lambda: lists(control_plane, place), 60)
    place.train("later", scheduling=QUEUE)
    place.until("Suspended", "later")

    assert set(lists(control_plane, place)) == {403}
    assert message(place) == WAITS
    assert operator.said("refused") == operator.said("not reconciled") == []
