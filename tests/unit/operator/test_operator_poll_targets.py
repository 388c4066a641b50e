"""The operator derives the pods that it polls from the watch events of TrainingJobs, Jobs and pods."""

import pytest

from palaestra.operator.poll_targets import PollTargets
from palaestra.plan.layout import STATUS_PORT


def named(name, uid, owner=None, **more):
    """Return an object of the TrainingJob `job` in `robots`."""
    owners = [{"uid": owner}] if owner else []
    labels = {"palaestra.dev/job": "job"}
    metadata = {"namespace": "robots", "name": name, "uid": uid, "labels": labels, "ownerReferences": owners}
    return {"metadata": metadata | more.pop("metadata", {}), **more}


def pod(state="running", address="10.1.2.3", owner="job-uid", **metadata):
    """Return a pod whose trainer container is in this state."""
    status = {"podIP": address, "containerStatuses": [{"name": "trainer", "state": {state: {}}}]}
    return named("job-r0-x", "pod-uid", owner, status=status, metadata=metadata)


@pytest.fixture
def trainers():
    """Return poll targets that know one TrainingJob and its Job."""
    known = PollTargets()
    known.training_job(named("job", "tj-uid"), exists=True)
    known.job(named("job-r0", "job-uid", "tj-uid"), exists=True)
    return known


def test_a_pod_whose_trainer_runs_is_asked(trainers):
    """The operator polls the address of the pod, and uses the response for the pod's job."""
    trainers.pod(pod(), exists=True)

    (target,) = trainers.targets()
    assert (target.key, target.uid, target.host) == (("robots", "job"), "pod-uid", "10.1.2.3")
    assert target.port == STATUS_PORT


@pytest.mark.parametrize(
    "other",
    [
        pod(state="waiting"),
        pod(state="terminated"),
        pod(owner="another-uid"),
        pod(owner=None),
        pod(address=""),
        pod(address="metadata.internal"),
        pod(deletionTimestamp="2025-01-31T12:00:00Z"),
        pod(labels={"palaestra.dev/job": "another"}),
        named("job-r0-x", "pod-uid", "job-uid"),
    ],
    ids=[
        "waits",
        "ended",
        "of another Job",
        "of no Job",
        "no address",
        "a name",
        "goes",
        "labelled",
        "empty",
    ],
)
def test_any_other_pod_is_not_asked(trainers, other):
    """Any user can create a pod with these labels and any address.

    A host name as the address would even cause a DNS lookup.
    """
    trainers.pod(pod(), exists=True)
    trainers.pod(other, exists=True)

    assert trainers.targets() == []


def test_a_trainer_whose_objects_go_is_asked_no_more(trainers):
    """The TrainingJob, the Job and the pod may be deleted in any order."""
    trainers.pod(pod(), exists=True)

    trainers.job(named("job-r0", "job-uid", "tj-uid"), exists=False)
    without_job = trainers.targets()
    trainers.job(named("job-r0", "job-uid", "tj-uid"), exists=True)
    trainers.training_job(named("job", "tj-uid"), exists=False)
    without_training_job = trainers.targets()
    trainers.training_job(named("job", "tj-uid"), exists=True)
    trainers.pod(pod(), exists=False)

    assert (without_job, without_training_job, trainers.targets()) == ([], [], [])


def test_a_job_that_does_not_belong_to_the_training_job_makes_no_trainers(trainers):
    """A user who may create Jobs must not be able to make the operator poll a thousand pods."""
    trainers.job(named("job-r0", "job-uid", "stranger"), exists=True)
    trainers.pod(pod(), exists=True)

    assert trainers.targets() == []


def test_an_address_of_ipv6_is_one(trainers):
    """Pods in an IPv6 cluster must be polled too."""
    trainers.pod(pod(address="fd00::1"), exists=True)

    assert [each.host for each in trainers.targets()] == ["fd00::1"]
