"""The pod that reads a volume: as secure as the run's own, able to read one folder, ending by itself."""

import pytest

from palaestra.client.volume_reader_pod import reading_pod, run_directory
from palaestra.plan import ClusterLayout, Images, identified, plan
from tests.unit.view.jobs import make_job

UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"
SCHEDULING = {"nodeSelector": {"pool": "robots"}, "tolerations": [{"key": "robots", "operator": "Exists"}]}


@pytest.fixture
def job():
    """A job for certain nodes."""
    return identified(make_job(spec={"scheduling": SCHEDULING}), UID)


@pytest.fixture
def template(job):
    """The template of its Job, as planned."""
    images = Images(trainer="trainer:1", stub="stub:1", mujoco="mujoco:1", webots="webots:1")
    return plan(job, ClusterLayout(images=images)).replicas[0].job["spec"]["template"]


@pytest.fixture
def pod(job, template):
    """The pod."""
    return reading_pod(job, template, "job-0-fetch-abc", lives_s=600)


def test_it_mounts_the_run_and_nothing_else_for_reading_only(pod):
    """A fetch can damage no run."""
    [container] = pod["spec"]["containers"]

    assert [each["name"] for each in pod["spec"]["volumes"]] == ["run"]
    assert [each["readOnly"] for each in container["volumeMounts"]] == [True]
    assert "initContainers" not in pod["spec"]


def test_it_meets_restricted_and_holds_no_token(pod, template):
    """It is admitted wherever the run was."""
    [container] = pod["spec"]["containers"]

    assert pod["spec"]["securityContext"] == template["spec"]["securityContext"]
    assert container["securityContext"]["capabilities"] == {"drop": ["ALL"]}
    assert container["securityContext"]["allowPrivilegeEscalation"] is False
    assert container["securityContext"]["readOnlyRootFilesystem"] is True
    assert pod["spec"]["automountServiceAccountToken"] is False


def test_it_has_the_trainers_image_and_its_nodes(pod):
    """The image is there already, and the volume can be reached."""
    assert pod["spec"]["containers"][0]["image"] == "trainer:1"
    assert pod["spec"]["nodeSelector"] == SCHEDULING["nodeSelector"]
    assert pod["spec"]["tolerations"][0]["key"] == "robots"


def test_it_ends_by_itself_and_goes_with_the_job(pod):
    """The client that made it may be killed before it deletes it."""
    [owner] = pod["metadata"]["ownerReferences"]

    assert pod["spec"]["activeDeadlineSeconds"] == 600
    assert owner["uid"] == UID
    assert owner["controller"] is False


def test_it_is_not_taken_for_a_pod_of_the_job(pod):
    """Neither by the operator, which counts pods by their label, nor by a Job that would adopt it."""
    assert not {"palaestra.dev/job", "palaestra.dev/replica", "batch.kubernetes.io/job-name"} & set(
        pod["metadata"]["labels"]
    )


def test_the_template_is_left_as_it_was(job, template):
    """Planning is pure, and so is this."""
    before = repr(template)

    reading_pod(job, template, "a", lives_s=1)

    assert repr(template) == before


def test_the_run_directory_is_the_trainers(template):
    """The path is read from the trainer's own configuration and not passed a second time."""
    assert run_directory(template) == f"/var/lib/palaestra/{UID}/0"
