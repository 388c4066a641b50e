"""The columns of TrainingJobs in `kubectl get`, and field selectors, with a real API server."""

import itertools

import pytest

from palaestra_protocol.pod.status import CheckpointStatus, Termination
from tests.integration.operator.cluster import world_of
from tests.waiting import eventually

SAVED = CheckpointStatus(step=20, time="2026-01-31T12:00:00Z")


@pytest.fixture
def kubectl(control_plane, place):
    """Return a function that runs `kubectl get` in the namespace and returns the lines of the output."""

    def typed(*words):
        done = control_plane.kubectl("get", "--namespace", place.name, *words)
        assert done.returncode == 0, done.stderr
        return done.stdout.splitlines()

    return typed


def test_kubectl_get_shows_why_a_job_waits_and_how_far_it_has_to_go(place, start, kubectl):
    """Without the reason, a missing world and a wrong image would both show as `Pending 0/1`."""
    start()
    place.train("no-world", **world_of("nowhere"))
    place.train("no-image", trainer={"steps": 7000})
    [pod] = place.pods("no-image")
    place.hold_up(pod, "ImagePullBackOff", "no such image")

    def rows():
        headings, *jobs = (line.split() for line in kubectl("tj"))
        assert headings == ["NAME", "STATUS", "REASON", "REPLICAS", "STEP", "TARGET", "SUCCESS", "AGE"]
        return [job[:5] for job in jobs]  # if no step is shown, the target is the fifth word

    image, world = ["Pending", "ImagePull", "0/1", "7000"], ["Pending", "WorldMissing", "0/1", "50000"]
    eventually(lambda: rows() == [["no-image", *image], ["no-world", *world]])


def test_kubectl_get_wide_shows_the_attempts_of_the_replicas(place, start, kubectl):
    """A user sees the restarts and nodes of replicas, and the age of the last checkpoint."""
    start()
    place.train(replicas=2)
    for pod in place.pods(count=2):
        place.bind(pod)
        place.run(pod)
    place.until("Running")
    place.end(place.pods(count=2)[0], 1, Termination(step=20, reason="Unexpected: it", last_checkpoint=SAVED))

    def cells():
        headings, row = (line for line in kubectl("tj", "-o", "wide"))
        ends = [headings.index(name) for name in ("ATTEMPT", "RESTARTS", "CHECKPOINT", "NODE", "AGE")]
        return [row[begin:end].strip() for begin, end in itertools.pairwise(ends)]

    attempt, restarts, checkpoint, nodes = eventually(lambda: found if "" not in (found := cells()) else None)
    assert (attempt, restarts) == ("2", "1")
    assert checkpoint.endswith(("d", "y"))
    assert nodes == "node-1"


def test_kubectl_describe_shows_no_empty_field_of_the_status(place, start, control_plane):
    """A heading without content would look like lost data to a user."""
    start()
    place.train()
    [pod] = place.pods()
    place.run(pod)
    place.until("Running")

    described = control_plane.kubectl("-n", place.name, "describe", "trainingjob", "job").stdout

    lines = described[described.index("\nStatus:") : described.index("\nEvents:")].splitlines()
    depths = [len(line) - len(line.lstrip()) for line in lines]
    pairs = zip(lines, depths, [*depths[1:], 0], strict=True)
    assert [line for line, depth, below in pairs if line.endswith(":") and below <= depth and line] == []


def test_kubectl_selects_jobs_by_phase_and_by_queue(place, start, kubectl):
    """In a namespace with hundreds of jobs, a user wants to list only those that run."""
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
    """A user types `kubectl get all` in an unknown namespace and must see its TrainingJobs."""
    place.train()

    assert "trainingjob.palaestra.dev/job" in kubectl(category, "-o", "name")
