"""A TrainingJob gives its author no new access: it may only name objects that are labeled for jobs."""

import pytest

from tests.e2e.jobs import make_claim
from tests.e2e.namespace import LONG_S, OPERATOR, SYSTEM

pytestmark = [pytest.mark.beside, pytest.mark.timeout(1200)]

SECRETS_ROLE = "palaestra-job-secrets"
FOR_JOBS = {"metadata": {"labels": {"palaestra.dev/for-jobs": "true"}}}


def let_secrets_be_read(namespace):
    """Bind the role to read Secrets to the operator, as an administrator does for each namespace."""
    role = {"apiGroup": "rbac.authorization.k8s.io", "kind": "ClusterRole", "name": SECRETS_ROLE}
    subject = {"kind": "ServiceAccount", "name": OPERATOR, "namespace": SYSTEM}
    binding = {"metadata": {"name": SECRETS_ROLE}, "roleRef": role, "subjects": [subject]}
    namespace.create("rolebindings", binding)


def test_a_claim_is_used_only_if_it_is_for_jobs(namespace, job):
    """Without this rule, any author of TrainingJobs could write to every volume of the namespace."""
    namespace.apply(job("writes", script="touch /var/lib/palaestra/mark", storage={"existingClaim": "kept"}))
    namespace.wait(lambda: namespace.condition("writes", "Accepted").get("reason") == "ClaimMissing")

    namespace.create("persistentvolumeclaims", make_claim("kept"))
    namespace.wait(lambda: namespace.condition("writes", "Accepted").get("reason") == "ClaimNotForJobs")
    assert namespace.select("jobs", "writes") == []

    namespace.cluster.patch("persistentvolumeclaims", namespace.name, "kept", FOR_JOBS)
    assert namespace.wait_for_end("writes", LONG_S) == "Succeeded"
    assert namespace.select("persistentvolumeclaims", "writes") == []


def test_a_secret_is_used_only_if_it_is_for_jobs(namespace, job):
    """Without this rule, a user who may only create TrainingJobs could read every Secret of the namespace."""
    let_secrets_be_read(namespace)
    variable = {"name": "WORD", "secretKeyRef": {"name": "words", "key": "word"}}
    namespace.apply(job("reads", script='test "$WORD" = open', trainer={"env": [variable]}, backoffLimit=0))
    namespace.wait(lambda: namespace.condition("reads", "Accepted").get("reason") == "SecretMissing")

    namespace.create("secrets", {"metadata": {"name": "words"}, "stringData": {"word": "open"}})
    namespace.wait(lambda: namespace.condition("reads", "Accepted").get("reason") == "SecretNotForJobs")
    assert namespace.select("jobs", "reads") == []

    namespace.cluster.patch("secrets", namespace.name, "words", FOR_JOBS)
    assert namespace.wait_for_end("reads", LONG_S) == "Succeeded"
