"""The installation: everything that `kubectl apply -f manifests/install.yaml` makes.

Roles hold what the operator uses and nothing else. It can read no Secret: the role that lets it look
at one for a job is there, and bound by nobody until somebody binds it in a namespace.
"""

from importlib.metadata import version
from typing import Any

from palaestra.api.crd import crd
from palaestra.operator.options import DEFAULT_NAMESPACE as NAMESPACE
from palaestra.operator.options import NAME
from palaestra.plan.network_policy import OPERATOR_LABEL
from palaestra.plan.text import as_yaml

SECRETS_ROLE = "palaestra-job-secrets"
PORT = 8080
USER = 65532
LABELS = {"app.kubernetes.io/name": "palaestra", "app.kubernetes.io/component": "operator"}

_HEADER = "# Generated from operator/src/palaestra/manifests.py by `make golden`; edit that instead.\n"

Object = dict[str, Any]


def install_text() -> str:
    """Return the installation of this release as YAML."""
    return _HEADER + as_yaml(install(version("palaestra")))


def install(release: str) -> tuple[Object, ...]:
    """Return the objects of an installation in the order in which they are made."""
    return (
        _namespace(),
        crd(),
        _object("v1", "ServiceAccount", namespaced=True),
        *_cluster_role(),
        *_lease_role(),
        _secrets_role(),
        _deployment(release),
    )


def _object(api_version: str, kind: str, name: str = NAME, *, namespaced: bool = False) -> Object:
    metadata: Object = {"name": name, "labels": dict(LABELS)}
    if namespaced:
        metadata["namespace"] = NAMESPACE
    return {"apiVersion": api_version, "kind": kind, "metadata": metadata}


def _namespace() -> Object:
    namespace = _object("v1", "Namespace", NAMESPACE)
    namespace["metadata"]["labels"]["pod-security.kubernetes.io/enforce"] = "restricted"
    return namespace


def _rule(group: str, resources: str, verbs: str) -> Object:
    return {"apiGroups": [group], "resources": resources.split(), "verbs": verbs.split()}


def _cluster_role() -> tuple[Object, Object]:
    """Return the role for all namespaces and its binding."""
    role = _object("rbac.authorization.k8s.io/v1", "ClusterRole")
    role["rules"] = [
        _rule("palaestra.dev", "trainingjobs", "get list watch delete"),  # delete: ttlSecondsAfterFinished
        _rule("palaestra.dev", "trainingjobs/status", "patch"),
        # Owner references that block deletion need it where OwnerReferencesPermissionEnforcement is on.
        _rule("palaestra.dev", "trainingjobs/finalizers", "update"),
        _rule("batch", "jobs", "get list watch create patch"),
        _rule("", "pods", "list watch"),
        _rule("", "configmaps persistentvolumeclaims", "get list watch create"),
        _rule("networking.k8s.io", "networkpolicies", "list watch create patch"),
        _rule("", "events", "get list create patch"),  # list: why a Job's pods could not be made
    ]
    return role, _binding("ClusterRole")


def _lease_role() -> tuple[Object, Object]:
    """Return the role for the Lease that the leader holds, and its binding."""
    role = _object("rbac.authorization.k8s.io/v1", "Role", namespaced=True)
    role["rules"] = [
        # A name cannot be demanded of what is yet to be created.
        _rule("coordination.k8s.io", "leases", "create"),
        {**_rule("coordination.k8s.io", "leases", "get patch"), "resourceNames": [NAME]},
    ]
    return role, _binding("Role")


def _binding(kind: str) -> Object:
    binding = _object("rbac.authorization.k8s.io/v1", f"{kind}Binding", namespaced=kind == "Role")
    binding["roleRef"] = {"apiGroup": "rbac.authorization.k8s.io", "kind": kind, "name": NAME}
    binding["subjects"] = [{"kind": "ServiceAccount", "name": NAME, "namespace": NAMESPACE}]
    return binding


def _secrets_role() -> Object:
    """Return the role that no binding comes with: RBAC knows no labels, so a person chooses where."""
    role = _object("rbac.authorization.k8s.io/v1", "ClusterRole", SECRETS_ROLE)
    role["rules"] = [_rule("", "secrets", "get")]
    return role


def _deployment(release: str) -> Object:
    deployment = _object("apps/v1", "Deployment", namespaced=True)
    deployment["spec"] = {
        "replicas": 1,
        "selector": {"matchLabels": dict(LABELS)},
        "template": {
            "metadata": {"labels": {**LABELS, OPERATOR_LABEL: "true"}},  # trainers let it in
            "spec": {
                "serviceAccountName": NAME,
                "enableServiceLinks": False,
                "terminationGracePeriodSeconds": 10,
                "securityContext": {
                    "runAsNonRoot": True,
                    "runAsUser": USER,
                    "runAsGroup": USER,
                    "seccompProfile": {"type": "RuntimeDefault"},
                },
                "containers": [_container(release)],
            },
        },
    }
    return deployment


def _container(release: str) -> Object:
    return {
        "name": "operator",
        "image": f"{NAME}:{release}",
        "imagePullPolicy": "IfNotPresent",
        "command": ["palaestra", "operator"],
        "ports": [{"name": "metrics", "containerPort": PORT, "protocol": "TCP"}],
        "livenessProbe": _probe("/healthz", initialDelaySeconds=10, failureThreshold=6),
        "readinessProbe": _probe("/readyz", failureThreshold=3),
        "resources": {"requests": {"cpu": "50m", "memory": "96Mi"}, "limits": {"memory": "192Mi"}},
        "securityContext": {
            "allowPrivilegeEscalation": False,
            "capabilities": {"drop": ["ALL"]},
            "readOnlyRootFilesystem": True,
        },
    }


def _probe(path: str, **timing: int) -> Object:
    return {
        "httpGet": {"path": path, "port": "metrics"},
        "periodSeconds": 10,
        "timeoutSeconds": 5,
        **timing,
    }
