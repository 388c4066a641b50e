"""The NetworkPolicy of a job's pods.

ROS 1 has no authentication. Its programs listen on loopback only, and the policy protects them in addition.

Ingress is allowed from the operator's pods and from the monitoring namespace, for metrics, the trainer's
status and the simulators' states. The containers of a pod communicate on loopback, to which policies do not
apply. A node always reaches its own pods, for their probes. Egress is open unless the job closes it.
"""

from typing import Any

from palaestra.api import TrainingJob
from palaestra.api.job import Egress
from palaestra.plan.layout import HEALTH_PORTS, Layout
from palaestra.plan.replica import JOB_LABEL, UID_LABEL, owner, uid_of

OPERATOR_LABEL = "palaestra.dev/operator"
NAMESPACE_LABEL = "kubernetes.io/metadata.name"  # the API server sets this label on each namespace
SHORT_UID = 8


def network_policy(job: TrainingJob, layout: Layout) -> dict[str, Any] | None:
    """Return the NetworkPolicy of all pods of the job; None if the layout's pods share a network.

    The policy's name contains the start of the job's uid, so that it differs from the policy of an earlier
    job with the same name.

    Raises:
        PlanError: the job has no uid.
    """
    operator, monitoring = layout.operator_namespace, layout.monitoring_namespace
    if operator is None or monitoring is None:
        return None
    uid = uid_of(job)
    closed = job.spec.network.egress is Egress.CLOSED
    labels = {JOB_LABEL: job.metadata.name, UID_LABEL: uid}
    return {
        "apiVersion": "networking.k8s.io/v1",
        "kind": "NetworkPolicy",
        "metadata": {
            "name": f"{job.metadata.name}-{uid[:SHORT_UID]}",
            "namespace": job.metadata.namespace,
            "labels": {"app.kubernetes.io/managed-by": "palaestra", **labels},
            "ownerReferences": [owner(job)],
        },
        "spec": {
            "podSelector": {"matchLabels": {JOB_LABEL: job.metadata.name}},
            "policyTypes": ["Ingress", "Egress"] if closed else ["Ingress"],
            "ingress": [{"from": _readers(operator, monitoring), "ports": _ports(layout)}],
            **({"egress": []} if closed else {}),
        },
    }


def _readers(operator: str, monitoring: str) -> list[dict[str, Any]]:
    return [
        {
            "namespaceSelector": {"matchLabels": {NAMESPACE_LABEL: operator}},
            "podSelector": {"matchLabels": {OPERATOR_LABEL: "true"}},
        },
        {"namespaceSelector": {"matchLabels": {NAMESPACE_LABEL: monitoring}}},
    ]


def _ports(layout: Layout) -> list[dict[str, Any]]:
    return [
        {"protocol": "TCP", "port": layout.ports.status},
        {"protocol": "TCP", "port": HEALTH_PORTS.start, "endPort": HEALTH_PORTS.stop - 1},
    ]
