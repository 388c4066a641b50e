"""The complete list of checkov's findings in the chart, with the reason why each finding is accepted."""

from typing import NamedTuple

import pytest

from tests.chart.checkov import Finding, findings
from tests.chart.helm import rendered
from tests.chart.modes import MODES

OPERATOR = ("Deployment", "palaestra-operator")
TENSORBOARD = ("Deployment", "palaestra-tensorboard")
JUPYTER = ("Deployment", "palaestra-jupyter")
TRIAL = ("Pod", "palaestra-test")
Objects = tuple[tuple[str, str], ...]


class Accepted(NamedTuple):
    """The reason why the findings of a check are accepted, and the objects to which they apply."""

    reason: str
    objects: Objects


ALWAYS = {
    "CKV_K8S_11": Accepted(
        "A CPU limit slows a pod down even on an idle node; CPU requests suffice, and memory is limited.",
        (OPERATOR, TENSORBOARD, JUPYTER, TRIAL),
    ),
    "CKV_K8S_38": Accepted("Both send requests to the API server.", (OPERATOR, TRIAL)),
    "CKV_K8S_8": Accepted("The test's pod ends by itself, at its deadline at the latest.", (TRIAL,)),
    "CKV_K8S_9": Accepted("No program sends requests to the test's pod.", (TRIAL,)),
    "CKV2_K8S_6": Accepted("The test's pod listens on no port, so it needs no NetworkPolicy.", (TRIAL,)),
}
BY_DEFAULT = {
    "CKV_K8S_43": Accepted("A digest depends on the registry, so the user sets it.", (OPERATOR, TRIAL)),
    "CKV_K8S_15": Accepted(
        "The images of a release never change; a node without a registry cannot pull.", (OPERATOR, TRIAL)
    ),
}
EXPECTED = {"default": {**ALWAYS, **BY_DEFAULT}, "everything": ALWAYS}


@pytest.fixture(scope="module")
def found():
    """Return the findings by mode; checkov starts slowly, so it runs once for all modes."""
    return findings({mode: rendered(MODES[mode]) for mode in EXPECTED})


@pytest.mark.parametrize("mode", EXPECTED)
def test_every_finding_has_a_reason_and_every_reason_a_finding(found, mode):
    """A new finding must be fixed or get a reason. When a finding is fixed, its reason must be removed."""
    parts = {OPERATOR, TRIAL} if mode == "default" else {OPERATOR, TENSORBOARD, JUPYTER, TRIAL}

    assert found[mode] == {
        Finding(check, *each)
        for check, accepted in EXPECTED[mode].items()
        for each in accepted.objects
        if each in parts
    }
