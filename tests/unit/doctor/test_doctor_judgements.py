"""The checks of `palaestra doctor` and their results."""

from copy import deepcopy
from pathlib import Path

import pytest
import yaml

from palaestra.api.crd import crd
from palaestra.cli.doctor import shown
from palaestra.doctor import CheckStatus
from palaestra.doctor.check_result import right, wrong
from palaestra.doctor.installation import judged_images
from palaestra.doctor.platform import FIRST, difference, judged_pod, judged_version, release, trial_pod
from palaestra.doctor.rbac import OPERATOR, OPERATOR_WITH_KUEUE

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("version", "verdict"),
    [("v1.9.3", "wrong"), ("v1.32.9", "wrong"), ("v1.33.2+k3s1", "ok"), ("v2.0.0", "ok"), ("", "wrong")],
)
def test_a_version_is_judged_by_whether_it_has_sidecars_for_good(version, verdict):
    """Sidecar containers are stable since Kubernetes 1.33, so the chart also requires this version."""
    assert judged_version("nodes", version).verdict == verdict


def test_versions_are_compared_as_numbers():
    """As text, "1.9" would be newer than "1.33"."""
    assert release("v1.9.3") < release("v1.33.0")


def test_the_first_version_is_the_charts():
    """The doctor must accept every version on which Helm installs the chart."""
    chart = yaml.safe_load((ROOT / "charts/palaestra/Chart.yaml").read_text())

    assert release(chart["kubeVersion"].removeprefix(">=")) == FIRST


def test_a_pod_that_came_back_as_it_was_is_right():
    """A webhook may add containers to a pod, as service meshes do."""
    pod = trial_pod("lab", "trainer:1")
    pod["spec"]["initContainers"].insert(0, {"name": "added-by-a-mesh"})

    assert judged_pod(pod).verdict is CheckStatus.RIGHT


def test_a_sidecar_that_became_an_ordinary_container_is_wrong():
    """The containers after it would wait for ever for the end of this init container."""
    pod = trial_pod("lab", "trainer:1")
    del pod["spec"]["initContainers"][0]["restartPolicy"]

    found = judged_pod(pod)

    assert found.verdict is CheckStatus.WRONG
    assert "webhook" in found.remedy


DIGEST = f"@sha256:{'0' * 64}"


PINNED = {part: part + DIGEST for part in ("operator", "trainer", "stub", "mujoco", "webots")}


def operator(**images):
    """Return the operator's container as in the chart, with these images instead of pinned ones."""
    own, *given = (PINNED | images).items()
    return {"image": own[1], "command": ["palaestra", *(f"--{part}-image={image}" for part, image in given)]}


def test_images_that_are_named_by_digest_are_right():
    """The content of an image with a digest cannot change."""
    assert judged_images(operator()).verdict is CheckStatus.RIGHT


@pytest.mark.parametrize("part", PINNED)
def test_an_image_that_is_named_by_tag_is_a_warning(part):
    """A registry can change the image of a tag, so a resumed run may get another image."""
    found = judged_images(operator(**{part: "registry.example.com/image:1"}))

    assert found.verdict is CheckStatus.WARNING
    assert found.fact.startswith("registry.example.com/image:1: ")
    assert "digest" in found.remedy


def test_images_of_an_operator_that_is_given_none_are_the_releases():
    """The operator then uses the images of its release, which have tags and no digests."""
    found = judged_images({"image": "operator" + DIGEST})

    assert found.fact.startswith("palaestra-trainer:")
    assert ", palaestra-stub:" in found.fact
    assert ", palaestra-mujoco:" in found.fact
    assert "webots" not in found.fact  # an operator without the option has no image of Webots


def test_a_definition_with_more_in_it_is_the_same():
    """An API server adds default values to the definition that it stores."""
    ours = crd()
    found = deepcopy(ours)
    found["spec"]["conversion"] = {"strategy": "None"}

    assert difference(ours["spec"], found["spec"], "spec") is None


def test_the_place_where_another_release_s_definition_differs_is_returned():
    """The path shows an administrator which field of the cluster's definition is outdated."""
    ours = crd()
    found = deepcopy(ours)
    del found["spec"]["versions"][0]["schema"]["openAPIV3Schema"]["properties"]["spec"]

    assert difference(ours["spec"], found["spec"], "spec") == (
        "spec.versions[0].schema.openAPIV3Schema.properties.spec"
    )


def test_the_operators_rights_are_those_of_an_installation():
    """If no role granted a permission, the doctor would always report that permission as missing.

    If the doctor did not check a permission, nobody would notice that the permission is missing.
    """
    installed = yaml.safe_load_all((ROOT / "manifests/install.yaml").read_text())
    [role] = [
        each
        for each in installed
        if each["kind"] == "ClusterRole" and each["metadata"]["name"] == "palaestra-operator"
    ]
    granted = {
        (group, resource, verb)
        for rule in role["rules"]
        for group in rule["apiGroups"]
        for resource in rule["resources"]
        for verb in rule["verbs"]
    }

    checked = {
        (each.group, each.resource, verb) for each in OPERATOR + OPERATOR_WITH_KUEUE for verb in each.verbs
    }
    assert checked == granted


def test_a_finding_is_a_line_and_its_remedy_another():
    """A reader can find the remedies by the arrow at the beginning of the line."""
    found = (
        right("nodes", "v1.36.0"),
        wrong("storage class", "the cluster has no storage class", "annotate one"),
    )

    lines = [line for each in found for line in shown(each)]

    assert [line.split() for line in lines] == [
        ["ok", "nodes", "v1.36.0"],
        ["wrong", "storage", "class", "the", "cluster", "has", "no", "storage", "class"],
        ["->", "annotate", "one"],
    ]
