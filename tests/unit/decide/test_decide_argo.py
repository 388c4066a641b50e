"""The health check for Argo CD in docs/howto/gitops.md, run unchanged with Argo CD's version of Lua."""

from pathlib import Path

import pytest
from lupa import lua51

from tests.pages import blocks

[CHECK] = blocks((Path(__file__).parents[3] / "docs/howto/gitops.md").read_text(), "lua")


@pytest.fixture
def health():
    """`health(scene)` returns the status and the message that Argo CD shows for the job of a scene."""
    lua = lua51.LuaRuntime(unpack_returned_tuples=True)
    check = lua.eval(f"function(obj)\n{CHECK}\nend")

    def of(scene):
        answer = check(lua.table_from(scene.raw, recursive=True))
        return answer["status"], answer["message"]

    return of


def test_a_job_that_no_operator_has_seen_is_progressing(make_scene, health):
    """If a new job counted as healthy for a moment, Argo CD would start the next sync wave too early."""
    scene = make_scene()

    assert health(scene) == ("Progressing", "the operator has not seen this generation yet")

    scene.raw["status"] = {"observedGeneration": 0}

    assert health(scene)[0] == "Progressing"


def test_a_job_that_starts_is_progressing_with_its_reason(accepted, health):
    """Argo CD shows the message on the page of the application."""
    scene = accepted()
    scene.container(scene.new_pod(), "trainer", waiting="ImagePullBackOff: no such image")
    scene.settle()

    assert health(scene) == ("Progressing", scene.replica().message)


def test_a_job_that_lacks_something_is_degraded_with_the_remedy(make_scene, health):
    """Argo CD's page shows the remedy, so a user need not open the TrainingJob."""
    scene = make_scene(storage={"existingClaim": "runs"})
    scene.settle()

    assert health(scene) == ("Degraded", scene.replica().message)


def test_a_job_that_trains_is_healthy(training, health):
    """`helm --wait` also returns as soon as the job trains."""
    scene, _ = training()

    assert health(scene) == ("Healthy", "Running")


def test_a_job_that_its_spec_suspends_is_suspended(make_scene, health):
    """Argo CD has a status Suspended, with which a sync wave does not wait for the job."""
    scene = make_scene(suspend=True)
    scene.settle()

    assert health(scene)[0] == "Suspended"


def test_a_job_that_failed_is_degraded_also_without_the_condition(training, last_word, health):
    """An older CustomResourceDefinition rejects the condition Stalled, so the phase alone must be enough."""
    scene, pod = training()
    scene.end(pod, 81, last_word(reason="Diverged: NaN"))
    scene.end_job("Failed", 0, "PodFailurePolicy")
    scene.settle()

    assert health(scene) == ("Degraded", scene.replica().message)

    scene.raw["status"]["conditions"] = scene.raw["status"]["conditions"][:5]

    assert health(scene) == ("Degraded", "Failed")
