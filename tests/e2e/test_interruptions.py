"""A run resumes from its last checkpoint after an interruption of any cause."""

import pytest

from tests.e2e.jobs import make_claim, make_slow_job
from tests.e2e.namespace import LONG_S, NO_RESTARTS, named

pytestmark = [pytest.mark.beside, pytest.mark.after_the_kills, pytest.mark.timeout(900)]

EVERY_STEPS = 100
STEPS = 1000
AMID = 150


def suspend(namespace, name, pod):
    """Suspend a job, check that the phase is Suspended after the pod has ended, and resume the job."""
    namespace.patch(name, suspend=True)
    namespace.wait(lambda: namespace.holds(name, "Suspended"))
    left = namespace.get("pods", pod)
    assert left is None or left["status"]["phase"] in {"Succeeded", "Failed"}
    assert namespace.status(name)["phase"] == "Suspended"
    namespace.patch(name, suspend=False)


def delete(namespace, name, pod):  # noqa: ARG001 - all interruptions have the same parameters
    """Delete the pod, as a person does."""
    namespace.cluster.delete("pods", namespace.name, pod)


def evict(namespace, name, pod):  # noqa: ARG001
    """Evict the pod as a drain of its node does."""
    namespace.cluster.evict(namespace.name, pod)


def mark(namespace, name, pod):
    """Set the annotation that an operator leaves if it is killed before it evicts the pod."""
    uid = namespace.get("pods", pod)["metadata"]["uid"]
    annotations = {"palaestra.dev/replaced": f"1 {uid} Stalled: it stands still"}
    namespace.cluster.patch("jobs", namespace.name, f"{name}-0", {"metadata": {"annotations": annotations}})


@pytest.mark.parametrize(
    ("interrupt", "counted"),
    [(suspend, "suspension"), (delete, "disruption"), (evict, "disruption"), (mark, "operator")],
)
def test_a_run_goes_on_from_its_checkpoint_after(interrupt, counted, namespace):
    """A run loses at most one checkpoint interval, and no step if its trainer saves a last checkpoint."""
    namespace.apply(make_slow_job("amid", steps=STEPS, every_steps=EVERY_STEPS, backoffLimit=0))
    first, before = namespace.wait_for_step("amid", AMID)

    interrupt(namespace, "amid", first)
    namespace.wait(lambda: namespace.get("pods", first) is None)
    second, after = namespace.wait_for_step("amid", 1)
    attempts = namespace.in_run(second, "attempts.jsonl")

    resumed_at = int(attempts[1]["reason"].removeprefix("resumed at step "))
    assert second != first
    assert after >= resumed_at >= before - EVERY_STEPS
    assert len(attempts) == 2
    assert namespace.wait_for_end("amid", LONG_S) == "Succeeded"
    replica = namespace.replica("amid")
    assert replica["step"] == STEPS
    assert replica["restarts"] == {**NO_RESTARTS, counted: 1}
    assert replica["attempt"] == 2
    assert [named(pod) for pod in namespace.pods("amid", live=False)] == [second]


def test_a_run_that_has_ended_is_prolonged_by_another_job(namespace):
    """A user trains longer with a second job that names the claim and the run of the first job."""
    namespace.create("persistentvolumeclaims", make_claim("runs", labels={"palaestra.dev/for-jobs": "true"}))
    storage = {"existingClaim": "runs"}
    namespace.apply(make_slow_job("first", steps=300, every_steps=EVERY_STEPS, storage=storage))
    assert namespace.wait_for_end("first", LONG_S) == "Succeeded"

    uid = namespace.get("trainingjobs", "first")["metadata"]["uid"]
    storage |= {"resumeFrom": uid}
    namespace.apply(make_slow_job("longer", steps=500, every_steps=EVERY_STEPS, storage=storage))

    assert namespace.wait_for_end("longer", LONG_S) == "Succeeded"
    assert namespace.replica("longer")["step"] == 500
    (pod,) = namespace.pods("longer", live=False)
    assert "resumed at step 300" in namespace.cluster.kubectl("logs", "-n", namespace.name, named(pod))


def test_a_run_whose_claim_is_deleted_waits_for_a_person(namespace):
    """Without its claim, the run would restart at step 0 unnoticed, so a person must allow the restart."""
    namespace.apply(make_slow_job("amid", steps=STEPS, every_steps=EVERY_STEPS))
    _, lost_at = namespace.wait_for_step("amid", AMID)
    namespace.patch("amid", suspend=True)
    namespace.wait(lambda: namespace.holds("amid", "Suspended") and not namespace.pods("amid"), LONG_S)
    [claim] = map(named, namespace.select("persistentvolumeclaims", "amid"))

    namespace.cluster.delete("persistentvolumeclaims", namespace.name, claim)
    namespace.wait(lambda: namespace.get("persistentvolumeclaims", claim) is None)
    namespace.patch("amid", suspend=False)

    namespace.wait(lambda: namespace.events("amid", "RunLost"))
    assert namespace.replica("amid")["lost"]["what"] == "Claim"
    assert namespace.get("persistentvolumeclaims", claim) is None
    word = {"metadata": {"annotations": {"palaestra.dev/restart-lost-runs": "now"}}}
    namespace.cluster.patch("trainingjobs", namespace.name, "amid", word)
    again, step = namespace.wait_for_step("amid", 1)
    assert step < lost_at
    assert "new run" in namespace.in_run(again, "attempts.jsonl")[0]["reason"]
    assert namespace.replica("amid")["lost"]["step"] >= EVERY_STEPS
    namespace.wait(lambda: namespace.events("amid", "RunRestarted"))
