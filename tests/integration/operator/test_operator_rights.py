"""The roles of an installation hold exactly what the operator uses, by the API server's own record."""

import json

from palaestra.cluster.resources import CONFIG_MAPS, JOBS, TRAINING_JOBS
from palaestra.operator.options import DEFAULT_NAMESPACE as NAMESPACE
from palaestra.operator.options import NAME
from tests.chart.installation import SECRETS_ROLE, installed
from tests.integration.operator.cluster import eventually, stranger, world_map, world_of
from tests.integration.operator.test_operator_refusals import limited, quota

USER = f"system:serviceaccount:{NAMESPACE}:{NAME}"
UNSEEN = {
    # What the API server asks for besides the verb of the request: to apply what is not there yet, and,
    # with OwnerReferencesPermissionEnforcement, to make an owner wait for what it owns.
    ("networking.k8s.io", "networkpolicies", "create"),
    ("palaestra.dev", "trainingjobs/finalizers", "update"),
}


def granted():
    """Return (group, resource, verb) of all rights that come with an installation."""
    return {
        (group, resource, verb)
        for each in installed()
        if each["kind"] in {"ClusterRole", "Role"} and each["metadata"]["name"] != SECRETS_ROLE
        for rule in each["rules"]
        for group in rule["apiGroups"]
        for resource in rule["resources"]
        for verb in rule["verbs"]
    }


def used(control_plane):
    """Return (group, resource, verb) of all requests of the operator."""
    return {
        (target.get("apiGroup", ""), _resource(target), event["verb"])
        for line in control_plane.audit_log.read_text().splitlines()
        if (event := json.loads(line))["user"]["username"] == USER and (target := event.get("objectRef"))
    }


def _resource(target):
    return "/".join(filter(None, (target["resource"], target.get("subresource"))))


def test_every_right_is_used_and_none_is_missing(place, start, control_plane):
    """A grand tour through everything that an operator does; what nobody uses should not be granted."""
    operator = start(elect=True)
    place.create(JOBS, stranger("taken-0"))
    place.create(CONFIG_MAPS, world_map())
    place.train("taken")
    place.train("claimed", storage={"existingClaim": "shared"})
    place.train("mapped", **world_of("world"))
    place.train("brief", ttlSecondsAfterFinished=1, trainer={"algorithm": {"name": "SAC"}})
    place.train()
    place.pods()
    for _ in range(2):  # the second operator meets the events of the first
        suspend(place, flag=True)
        suspend(place, flag=False)
        operator.stop()
        operator = start(elect=True)
    eventually(lambda: place.get(TRAINING_JOBS, "brief") is None)
    limited(place, quota(pods=True))
    place.train("refused")
    eventually(lambda: "PodsRefused" in place.events("refused"))

    asked = {each for each in used(control_plane) if each[1] != "secrets"}
    assert granted() - asked == UNSEEN
    assert asked <= granted()


def suspend(place, *, flag):
    """Suspend or resume the job, and wait until its Job is."""
    place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {"suspend": flag}})
    eventually(lambda: place.get(JOBS, "job-0")["spec"].get("suspend", False) is flag)
