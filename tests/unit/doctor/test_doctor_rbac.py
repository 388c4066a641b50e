"""The doctor's report about permissions that the operator's account lacks."""

import pytest

from palaestra.cluster import NotFound
from palaestra.doctor import CheckStatus, Site
from palaestra.doctor.installation import operator_rights

WORKLOADS = ("kueue.x-k8s.io", "workloads", "list")
JOBS = ("batch", "jobs", "create")


class Server:
    """A fake API server that refuses given permissions and may serve Kueue's Workloads."""

    def __init__(self, refused, workloads=""):
        self._refused, self._workloads = refused, workloads

    def get(self, resource, namespace, name):
        """Raise NotFound, as if the operator had no Deployment."""
        raise NotFound(404, "NotFound", f"{resource.plural} {namespace}/{name}")

    def serves(self, group_version):
        """Return whether the server serves this version of Kueue's API."""
        return group_version == self._workloads

    def create(self, _, review):
        """Return the response to a SubjectAccessReview."""
        asked = review["spec"]["resourceAttributes"]
        right = (asked["group"], asked["resource"], asked["verb"])
        return {"status": {"allowed": right not in self._refused}}


def examined(*refused, workloads="kueue.x-k8s.io/v1beta2"):
    """Return the doctor's results for an operator whose account lacks the given permissions."""
    api = Server(refused, workloads)
    return list(operator_rights(Site(api=api, namespace="lab", operator_namespace="palaestra-system")))


def test_a_role_that_cannot_read_workloads_is_a_warning_where_kueue_is():
    """Without this permission jobs still train, but their status lacks Kueue's messages."""
    [found] = examined(WORKLOADS)

    assert found.verdict is CheckStatus.WARNING
    assert "may not list workloads in lab" in found.fact
    assert found.remedy == "install the roles of this release, for this namespace too"


@pytest.mark.parametrize("served", ["", "kueue.x-k8s.io/v1beta1"])
def test_without_workloads_that_the_operator_reads_their_right_is_not_checked(served):
    """Without Kueue the permission has no effect, so a warning would only distract the reader."""
    [found] = examined(WORKLOADS, workloads=served)

    assert found.verdict is CheckStatus.RIGHT


def test_a_right_that_training_needs_is_wrong_beside_the_warning():
    """One remedy solves both problems, but only the missing permission for Jobs changes the exit code."""
    found = examined(JOBS, WORKLOADS)

    assert [each.verdict for each in found] == [CheckStatus.WRONG, CheckStatus.WARNING]
    assert "workloads" not in found[0].fact


def test_a_role_of_this_release_suffices():
    """With all permissions the doctor reports neither an error nor a warning."""
    [found] = examined()

    assert found.verdict is CheckStatus.RIGHT
