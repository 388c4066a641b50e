"""The pod that reads a volume is as restricted as the run's pod, reads one folder and ends by itself."""

import pytest

from palaestra.client.volume_reader_pod import reading_pod, run_directory
from palaestra.plan import ClusterLayout, Images, identified, plan
from tests.unit.view.jobs import running_job

UID = "0d1f3e5a-7c2b-4d68-9a40-c3b2a1908f7e"
SCHEDULING = {"nodeSelector": {"pool": "robots"}, "tolerations": [{"key": "robots", "operator": "Exists"}]}


@pytest.fixture
def job():
    """Return a job that runs only on certain nodes."""
    return identified(running_job(spec={"scheduling": SCHEDULING}), UID)


@pytest.fixture
def template(job):
    """Return the pod template of the planned Job."""
    images = Images(trainer="trainer:1", stub="stub:1", mujoco="mujoco:1", webots="webots:1")
    return plan(job, ClusterLayout(images=images)).replicas[0].job["spec"]["template"]


@pytest.fixture
def pod(job, template):
    """Return the pod that reads the volume of the run."""
    return reading_pod(job, template, "job-0-fetch-abc", lives_s=600)


def test_it_mounts_the_run_and_nothing_else_for_reading_only(pod):
    """`palaestra fetch` must not be able to damage a run."""
    [container] = pod["spec"]["containers"]

    assert [each["name"] for each in pod["spec"]["volumes"]] == ["run"]
    assert [each["readOnly"] for each in container["volumeMounts"]] == [True]
    assert "initContainers" not in pod["spec"]


def test_it_meets_restricted_and_holds_no_token(pod, template):
    """Every namespace that admitted the run's pod then admits this pod too."""
    [container] = pod["spec"]["containers"]

    assert pod["spec"]["securityContext"] == template["spec"]["securityContext"]
    assert container["securityContext"]["capabilities"] == {"drop": ["ALL"]}
    assert container["securityContext"]["allowPrivilegeEscalation"] is False
    assert container["securityContext"]["readOnlyRootFilesystem"] is True
    assert pod["spec"]["automountServiceAccountToken"] is False


def test_it_has_the_trainers_image_and_its_nodes(pod):
    """The nodes of the run have this image already, and they can mount the volume."""
    assert pod["spec"]["containers"][0]["image"] == "trainer:1"
    assert pod["spec"]["nodeSelector"] == SCHEDULING["nodeSelector"]
    assert pod["spec"]["tolerations"][0]["key"] == "robots"


def test_it_ends_by_itself_and_goes_with_the_job(pod):
    """The client may be killed before it deletes the pod."""
    [owner] = pod["metadata"]["ownerReferences"]

    assert pod["spec"]["activeDeadlineSeconds"] == 600
    assert owner["uid"] == UID
    assert owner["controller"] is False


def test_it_is_not_taken_for_a_pod_of_the_job(pod):
    """The operator counts pods by these labels, and a Job adopts pods by them."""
    assert not {"palaestra.dev/job", "palaestra.dev/replica", "batch.kubernetes.io/job-name"} & set(
        pod["metadata"]["labels"]
    )


def test_the_template_is_left_as_it_was(job, template):
    """The caller still uses the template, so the function must not change it."""
    before = repr(template)

    reading_pod(job, template, "a", lives_s=1)

    assert repr(template) == before


def test_the_run_directory_is_the_trainers(template):
    """The path comes from the trainer's configuration in the template, so both always agree."""
    assert run_directory(template) == f"/var/lib/palaestra/{UID}/0"
