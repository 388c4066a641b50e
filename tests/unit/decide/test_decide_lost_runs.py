"""A replica that has trained starts at step 0 again only if a person requests it."""

import pytest

from palaestra.api.reasons import Reason
from palaestra.decide import SetSuspend, accept, lacking_claims
from palaestra.observe import Objects, observe
from palaestra.plan.claim import claim_name
from palaestra_protocol.pod.status import CheckpointStatus, EvaluationStatus

EVALUATED = EvaluationStatus(step=20000, success_rate=0.9, mean_return=1.5)
SAVED = CheckpointStatus(step=21000, time="2026-01-31T12:00:00Z")
WORD = "palaestra.dev/restart-lost-runs"


def trained(training, **spec):
    """Return a scene whose replica has trained 21,812 steps and is suspended."""
    scene, pod = training(**spec)
    scene.poll(pod, step=21812, last_checkpoint=SAVED, last_evaluation=EVALUATED)
    scene.settle()
    scene.raw["spec"]["suspend"] = True
    scene.settle()
    scene.end(pod, 75)
    scene.delete(pod)
    scene.settle()
    scene.objects["pods"].clear()
    scene.settle()
    return scene


def resume(scene):
    """Resume the job and return the decision."""
    scene.raw["spec"]["suspend"] = False
    return scene.settle()


def emptied(training):
    """Return a scene whose second attempt found an empty run directory, and the pod of that attempt."""
    scene = trained(training)
    resume(scene)
    pod = scene.running_pod()
    scene.settle()
    scene.poll(pod, step=0, attempt=1)
    return scene, pod


def test_a_trained_replica_without_its_claim_is_held(training):
    """With a new, empty claim the training would start at step 0 and nobody would notice."""
    scene = trained(training)
    scene.objects["claims"].clear()

    decision = resume(scene)

    assert decision.actions == ()
    assert scene.job()["spec"]["suspend"] is True
    assert (scene.replica().phase, scene.replica().reason) == ("Suspended", "RunLost")
    assert scene.replica().message == (
        f"claim {claim_name('job', 0, scene.raw['metadata']['uid'])} does not exist, although the run on it "
        "was at step 21000; restore it, or run `palaestra restart job` to train from step 0 again"
    )
    assert (scene.replica().lost.what, scene.replica().lost.step) == ("Claim", 21000)
    assert [each.reason for each in decision.events if each.reason is Reason.RUN_LOST] == [Reason.RUN_LOST]


def test_a_job_with_a_lost_run_needs_a_person(training):
    """Programs that wait with kstatus must see `Stalled`, or they would wait for ever."""
    scene = trained(training)
    scene.objects["claims"].clear()

    resume(scene)

    assert [each.reason for each in scene.status.conditions if each.type == "Stalled"] == ["RunLost"]


def test_a_claim_that_is_lost_between_two_pods_suspends_the_job(training):
    """The next pod waits for the claim.

    If somebody created an empty claim, the pod would train from step 0.
    """
    scene, pod = training()
    scene.poll(pod, step=500)
    scene.settle()
    scene.take(pod)
    scene.objects["claims"].clear()

    scene.settle()

    assert scene.job()["spec"]["suspend"] is True
    assert scene.objects["claims"] == []
    assert scene.replica().reason == "RunLost"


def test_a_restored_claim_ends_the_hold(training):
    """The restored claim contains the run, so the training can resume."""
    scene = trained(training)
    claims = list(scene.objects["claims"])
    scene.objects["claims"].clear()
    resume(scene)
    scene.objects["claims"].extend(claims)

    decision = scene.settle()

    assert [each.suspend for each in decision.actions if isinstance(each, SetSuspend)] == [False]
    assert scene.replica().lost is None
    assert scene.replica().step == 21812


def test_a_person_s_word_begins_at_step_zero_again(training):
    """The annotation requests the restart.

    The status and an event report the restart, and the status forgets the earlier steps.
    """
    scene = trained(training)
    scene.objects["claims"].clear()
    resume(scene)
    scene.raw["metadata"]["annotations"] = {WORD: "2026-01-31T13:00:00Z"}

    decision = scene.settle()

    assert Reason.RUN_RESTARTED in [each.reason for each in decision.events]
    assert scene.objects["claims"]
    assert scene.job()["spec"]["suspend"] is False
    assert (scene.replica().step, scene.replica().furthest_step) == (None, None)
    assert scene.replica().last_evaluation is None
    assert (scene.replica().lost.step, scene.replica().lost.restarted) == (21000, scene.now)
    assert scene.status.lost_runs_restarted == "2026-01-31T13:00:00Z"


def test_reports_of_the_pods_before_do_not_count_after_a_restart(training, last_word):
    """The ended pod exists until its Job ends, and its termination message has the step of the lost run."""
    scene, pod = training()
    scene.end(pod, 1, last_word(step=21812, last_checkpoint=SAVED))
    scene.settle()
    scene.objects["claims"].clear()
    scene.settle()
    scene.raw["metadata"]["annotations"] = {WORD: "now"}

    scene.settle()

    assert (scene.replica().furthest_step, scene.replica().last_checkpoint) == (None, None)
    assert scene.objects["claims"]


def test_a_word_has_one_effect(training):
    """The annotation stays on the job. After another loss, a person must set a new value."""
    scene = trained(training)
    scene.raw["metadata"]["annotations"] = {WORD: "before the loss"}
    scene.settle()
    scene.objects["claims"].clear()

    resume(scene)

    assert scene.replica().reason == "RunLost"
    assert scene.objects["claims"] == []


def test_an_emptied_run_directory_is_noticed(training):
    """The trainer found no record of earlier attempts, so it reports attempt 1."""
    scene, _ = emptied(training)

    decision = scene.step()

    assert [each.suspend for each in decision.actions] == [True]
    assert scene.replica().reason == "RunLost"
    assert scene.replica().message.startswith(
        "the run directory is empty, although the run was at step 21000; restore it"
    )


def test_an_emptied_run_waits_after_its_pod_has_saved(training, last_word):
    """When the Job is suspended, the trainer saves its few new steps, which do not replace the lost ones."""
    scene, pod = emptied(training)
    scene.settle()
    saved = CheckpointStatus(step=120, time="2026-01-31T12:00:00Z")
    scene.end(pod, 75, last_word(step=120, attempt=1, last_checkpoint=saved))
    scene.delete(pod)

    scene.settle(60)

    assert scene.replica().reason == "RunLost"
    assert scene.job()["spec"]["suspend"] is True


def test_a_restart_continues_with_what_an_emptied_run_directory_holds_then(training):
    """A person may have restored the files before she sets the annotation."""
    scene, _ = emptied(training)
    scene.settle()
    scene.objects["pods"].clear()
    scene.settle()
    scene.raw["metadata"]["annotations"] = {WORD: "restored"}

    scene.settle()

    assert scene.job()["spec"]["suspend"] is False
    assert scene.replica().reason == "Starting"


@pytest.mark.parametrize(
    "storage",
    [
        pytest.param({"ephemeral": True}, id="ephemeral"),
        pytest.param({"existingClaim": "runs"}, id="of somebody else"),
    ],
)
def test_a_job_without_claims_of_its_own_lacks_none(make_scene, storage):
    """An ephemeral run is deleted with its pod, and the operator checks an existing claim by its name."""
    scene = make_scene(storage=storage)
    scene.there["PersistentVolumeClaim", "runs"] = {
        "metadata": {"labels": {"palaestra.dev/for-jobs": "true"}}
    }
    scene.settle()
    pod = scene.running_pod()
    scene.poll(pod, step=500)

    scene.settle()

    assert scene.replica().reason == "Training"


def test_a_replica_that_has_not_trained_gets_a_new_claim(training):
    """A replica at step 0 loses nothing with its claim."""
    scene, _ = training()
    scene.objects["claims"].clear()

    scene.settle()

    assert len(scene.objects["claims"]) == 1
    assert scene.replica().lost is None


def test_a_claim_of_a_replica_that_has_ended_is_not_looked_for(training, last_word):
    """People delete the claims of finished jobs.

    Without this rule, the operator would request such a claim every ten seconds.
    """
    scene, pod = training()
    scene.end(pod, 0, last_word(step=500, reason="Completed"))
    scene.end_job("Complete")
    scene.settle()
    job = accept(scene.raw)

    assert scene.replica().phase == "Succeeded"
    assert lacking_claims(job, observe(job, Objects())) == ()
