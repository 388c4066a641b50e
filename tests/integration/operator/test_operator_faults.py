"""If an operator is killed at any write, runs twice or is replaced, the jobs end in the same state."""

import threading
import time

import pytest

from palaestra.cluster.resources import JOBS, LEASES, PODS
from palaestra.operator.options import DEFAULT_NAMESPACE as NAMESPACE
from palaestra.operator.options import NAME
from palaestra_protocol.pod.status import Termination
from tests.waiting import eventually

DONE = Termination(step=20, reason="Completed", success_rate=0.9)
WRITES = 7  # a replica that succeeds needs: accepted, policy, worlds, claim, Job, running, succeeded
END_S = 2.0
LEASE_S = 15.0


def creations(control_plane, namespace):
    """Return the number of objects of each kind that were created in a namespace by any client."""
    counts = {}
    for event in control_plane.audit(namespace):
        target = event.get("objectRef", {})
        made = event["verb"] == "create" and event.get("responseStatus", {}).get("code") == 201
        if made and target.get("namespace") == namespace and "subresource" not in target:
            counts[target["resource"]] = counts.get(target["resource"], 0) + 1
    return counts


@pytest.mark.parametrize("write", range(1, WRITES + 1))
def test_killed_after_any_write_it_ends_the_same(write, place, start, control_plane):
    """The status and the objects must be the same, and the audit log must show no second creation."""
    mortal = start(dies_after=write)
    successor = threading.Thread(target=lambda: (mortal.wait(60), start()))
    successor.start()
    place.train()

    [pod] = place.pods()
    place.run(pod)
    place.until("Running")
    place.end(pod, word=DONE)
    place.until("Succeeded")
    successor.join(60)

    assert mortal.process.returncode == -9
    made = creations(control_plane, place.name)
    assert {kind: made.get(kind) for kind in ("jobs", "pods", "networkpolicies")} == {
        "jobs": 1,
        "pods": 1,
        "networkpolicies": None,  # applied, so the log shows a patch
    }
    assert sorted(each.split("/")[0] for each in place.children()) == [
        "ConfigMap",
        "Job",
        "NetworkPolicy",
        "PersistentVolumeClaim",
    ]


def test_two_operators_at_once_make_no_second_pod(place, start, control_plane):
    """Here both operators believe that they lead, so only the unique names prevent duplicates."""
    start()
    start()
    for i in range(3):
        place.train(f"job-{i}x", replicas=2)

    for i in range(3):
        for pod in place.pods(f"job-{i}x", count=2):
            place.run(pod)
    for i in range(3):
        place.until("Running", f"job-{i}x")

    made = creations(control_plane, place.name)
    assert (made["jobs"], made["pods"], made["persistentvolumeclaims"]) == (6, 6, 6)


def test_a_dead_leader_is_followed(place, start):
    """A leader that is killed does not release its Lease, so the successor waits for the expiry."""
    first = start(elect=True)
    eventually(lambda: first.said("leads"))
    second = start(elect=True)
    eventually(lambda: second.said("started"))

    first.kill()
    place.train()

    assert place.pods(deadline_s=3 * LEASE_S)
    assert second.said("leads")


def test_it_ends_within_two_seconds_of_sigterm_and_gives_the_lease_back(place, start):
    """A drain of the node must not wait for the operator, and the next leader must not wait for an expiry."""
    operator = start(elect=True)
    place.train()
    place.pods()

    began = time.monotonic()
    code = operator.stop()

    assert code == 0
    assert time.monotonic() - began < END_S
    assert not place.api.get(LEASES, NAMESPACE, NAME)["spec"].get("holderIdentity")


def test_an_upgrade_touches_nothing_of_a_running_job(place, start):
    """A job keeps the images of the release that accepted it, so an upgrade affects only new jobs."""
    old = start("--trainer-image=trainer:1")
    place.train()
    [pod] = place.pods()
    place.run(pod)
    place.until("Running")
    before, job = place.children(), place.get(JOBS, "job-0")
    old.stop()

    new = start("--trainer-image=trainer:2")
    place.train("later")
    [later] = place.pods("later")

    assert place.children() == before
    assert place.get(JOBS, "job-0")["metadata"]["generation"] == job["metadata"]["generation"]
    assert [each["metadata"]["uid"] for each in place.all(PODS, "job")] == [pod["metadata"]["uid"]]
    assert later["spec"]["containers"][0]["image"] == "trainer:2"
    assert new.process.poll() is None


def test_a_job_that_is_made_again_after_an_upgrade_has_its_old_images(place, start):
    """A user may delete the Job of a replica to restart the replica; its images must stay the same."""
    start("--trainer-image=trainer:1")
    place.train()
    place.pods()
    start("--trainer-image=trainer:2")
    before = place.get(JOBS, "job-0")["metadata"]["uid"]

    place.api.delete(JOBS, place.name, "job-0")
    eventually(
        lambda: (place.get(JOBS, "job-0") or {"metadata": {"uid": before}})["metadata"]["uid"] != before
    )

    [container] = place.get(JOBS, "job-0")["spec"]["template"]["spec"]["containers"]
    assert container["image"] == "trainer:1"


def test_a_job_that_cannot_be_read_delays_no_other(place, start):
    """A mistake that the API server has accepted must not block the other jobs."""
    start("--workers=1")
    place.train("wrong", trainer={"algorithm": {"name": "SAC"}})
    place.train("right")

    assert place.pods("right")
    assert place.until("Failed", "wrong")
    assert place.condition("Accepted", "wrong")["reason"] == "InvalidSpec"
