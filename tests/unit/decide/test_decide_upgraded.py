"""A job that an older release accepted continues, even if its spec breaks a new rule."""

import pytest

from palaestra.api.status import Phase

# Fields that this release does not accept in a new job.
ANTI_AFFINITY = {
    "requiredDuringSchedulingIgnoredDuringExecution": [
        {"labelSelector": {}, "namespaceSelector": {}, "topologyKey": "kubernetes.io/os"}
    ]
}
ADDRESS = "http://me:secret@tracking.example.com"
ACCEPTED_EARLIER = {
    "a password": {"trainer": {"env": [{"name": "MLFLOW_TRACKING_URI", "value": ADDRESS}]}},
    "a priority": {"scheduling": {"priorityClassName": "urgent"}},
    "a runtime": {"scheduling": {"runtimeClassName": "kata"}},
    "a toleration": {"scheduling": {"tolerations": [{"key": "dedicated", "operator": "Exists"}]}},
    "an anti-affinity": {"scheduling": {"affinity": {"podAntiAffinity": ANTI_AFFINITY}}},
}


@pytest.fixture(params=ACCEPTED_EARLIER)
def upgraded(request, make_scene):
    """Return a job that trains; an older release accepted it without the rule that its spec breaks."""
    scene = make_scene()
    scene.settle()
    scene.running_pod()
    scene.settle()
    scene.raw["spec"] |= ACCEPTED_EARLIER[request.param]
    return scene


def test_a_new_job_like_it_is_not_accepted(upgraded, make_scene):
    """If the rule did not exist, the tests below would pass without a meaning."""
    scene = make_scene(**upgraded.raw["spec"])

    decision = scene.settle()

    assert scene.status.conditions[0].status == "False"
    assert not [each for each in decision.actions if each.object["kind"] == "Job"]


def test_it_runs_on(upgraded):
    """An upgrade must not end a running training, so the operator does not touch the job's objects."""
    upgraded.restart()

    decision = upgraded.settle()

    assert (upgraded.status.phase, decision.actions) == (Phase.RUNNING, ())
    assert upgraded.status.conditions[0].status == "True"


def test_it_is_suspended_and_resumed(upgraded):
    """A user can still change `suspend`, like every field that may change."""
    for generation, suspend in enumerate((True, False), 2):
        upgraded.raw["spec"]["suspend"] = suspend
        upgraded.raw["metadata"]["generation"] = generation

        decision = upgraded.settle()

        assert [each.suspend for each in decision.actions] == [suspend]


def test_its_replica_is_planned_again(upgraded):
    """A user deleted the Job.

    The spec is the same as when it was accepted, so the operator creates it again.
    """
    upgraded.objects["pods"].clear()
    upgraded.objects["jobs"].clear()

    decision = upgraded.settle()

    assert [each.object["kind"] for each in decision.actions] == ["Job"]
    assert upgraded.status.phase is not Phase.FAILED
