"""What the doctor makes of what it sees."""

from copy import deepcopy
from pathlib import Path

import pytest
import yaml

from palaestra.api.crd import crd
from palaestra.cli.doctor import shown
from palaestra.doctor import Verdict
from palaestra.doctor.finding import right, wrong
from palaestra.doctor.platform import FIRST, difference, judged_pod, judged_version, release, trial_pod
from palaestra.doctor.rights import OPERATOR

ROOT = Path(__file__).parents[3]


@pytest.mark.parametrize(
    ("version", "verdict"),
    [("v1.9.3", "wrong"), ("v1.32.9", "wrong"), ("v1.33.2+k3s1", "ok"), ("v2.0.0", "ok"), ("", "wrong")],
)
def test_a_version_is_judged_by_whether_it_has_sidecars_for_good(version, verdict):
    """Since 1.33, which is what the chart demands, too."""
    assert judged_version("nodes", version).verdict == verdict


def test_versions_are_compared_as_numbers():
    """1.9 is older than 1.33."""
    assert release("v1.9.3") < release("v1.33.0")


def test_the_first_version_is_the_charts():
    """What helm installs, the doctor must find right."""
    chart = yaml.safe_load((ROOT / "charts/palaestra/Chart.yaml").read_text())

    assert release(chart["kubeVersion"].removeprefix(">=")) == FIRST


def test_a_pod_that_came_back_as_it_was_is_right():
    """Webhooks may add what they like."""
    pod = trial_pod("lab", "trainer:1")
    pod["spec"]["initContainers"].insert(0, {"name": "added-by-a-mesh"})

    assert judged_pod(pod).verdict is Verdict.RIGHT


def test_a_sidecar_that_became_an_ordinary_container_is_wrong():
    """Everything after it would wait for its end for ever."""
    pod = trial_pod("lab", "trainer:1")
    del pod["spec"]["initContainers"][0]["restartPolicy"]

    found = judged_pod(pod)

    assert found.verdict is Verdict.WRONG
    assert "webhook" in found.remedy


def test_a_definition_with_more_in_it_is_the_same():
    """API servers fill in defaults."""
    ours = crd()
    found = deepcopy(ours)
    found["spec"]["conversion"] = {"strategy": "None"}

    assert difference(ours["spec"], found["spec"], "spec") is None


def test_a_definition_of_another_release_is_told_with_the_place():
    """The first that is not as it is here."""
    ours = crd()
    found = deepcopy(ours)
    del found["spec"]["versions"][0]["schema"]["openAPIV3Schema"]["properties"]["spec"]

    assert difference(ours["spec"], found["spec"], "spec") == (
        "spec.versions[0].schema.openAPIV3Schema.properties.spec"
    )


def test_the_operators_rights_are_those_of_an_installation():
    """A right that is missing there would be told wrong for ever, and one more would go unnoticed."""
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

    assert {(each.group, each.resource, verb) for each in OPERATOR for verb in each.verbs} == granted


def test_a_finding_is_a_line_and_its_remedy_another():
    """The remedy is what the eye looks for."""
    found = (right("nodes", "v1.36.0"), wrong("storage class", "there is none", "annotate one"))

    lines = [line for each in found for line in shown(each)]

    assert [line.split() for line in lines] == [
        ["ok", "nodes", "v1.36.0"],
        ["wrong", "storage", "class", "there", "is", "none"],
        ["->", "annotate", "one"],
    ]
