"""What `kubectl get` shows of TrainingJobs, and what it can select, at a real API server."""

import pytest

from tests.integration.operator.cluster import world_of
from tests.waiting import eventually


@pytest.fixture
def kubectl(control_plane, place):
    """Return the lines that kubectl prints about this namespace."""

    def typed(*words):
        done = control_plane.kubectl("get", "--namespace", place.name, *words)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    return typed


def test_kubectl_get_shows_why_a_job_waits_and_how_far_it_has_to_go(place, start, kubectl):
    """A world that is missing and an image that is wrong both read `Pending 0/1`."""
    start()
    place.train("no-world", **world_of("nowhere"))
    place.train("no-image", trainer={"steps": 7000})
    [pod] = place.pods("no-image")
    place.hold_up(pod, "ImagePullBackOff", "no such image")

    def rows():
        headings, *jobs = (line.split() for line in kubectl("tj"))
        assert headings == ["NAME", "STATUS", "REASON", "REPLICAS", "STEP", "TARGET", "SUCCESS", "AGE"]
        return [job[:5] for job in jobs]  # no step yet, so the target is the fifth word

    image, world = ["Pending", "ImagePull", "0/1", "7000"], ["Pending", "WorldMissing", "0/1", "50000"]
    eventually(lambda: rows() == [["no-image", *image], ["no-world", *world]])


def test_kubectl_selects_jobs_by_phase_and_by_queue(place, start, kubectl):
    """A namespace with hundreds of jobs is asked for those that run, without a download of all."""
    start()
    place.train("waits", scheduling={"queueName": "trainings"})
    place.train("runs")
    [pod] = place.pods("runs")
    place.run(pod)
    place.until("Running", "runs")

    assert kubectl("tj", "-o", "name", "--field-selector", "status.phase=Running") == [
        "trainingjob.palaestra.dev/runs"
    ]
    assert kubectl("tj", "-o", "name", "--field-selector", "spec.scheduling.queueName=trainings") == [
        "trainingjob.palaestra.dev/waits"
    ]


@pytest.mark.parametrize("category", ["all", "palaestra"])
def test_kubectl_get_all_lists_training_jobs_too(place, kubectl, category):
    """`kubectl get all` is what people type into a namespace that they do not know."""
    place.train()

    assert "trainingjob.palaestra.dev/job" in kubectl(category, "-o", "name")
