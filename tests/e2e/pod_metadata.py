"""Labels and annotations of pods by which a user who may not create pods could gain permissions.

This module contains only data. tests/e2e/test_escalations.py tests the outcomes.
"""

from tests.e2e.escalations import Field

_LABELS = "spec.scheduling.podLabels"
_ANNOTATIONS = "spec.scheduling.podAnnotations"

# The API server accepts these TrainingJobs, but the operator holds them, because this installation allows no
# labels and annotations of pods.
METADATA = tuple(
    Field(name, gain, path, {key: value}, "PodMetadataNotAllowed")
    for name, gain, path, key, value in (
        (
            "a role of a cloud",
            "kube2iam gives the pod that role's keys.",
            _ANNOTATIONS,
            "iam.amazonaws.com/role",
            "arn:aws:iam::123456789012:role/admin",
        ),
        (
            "an identity of a cloud",
            "A webhook mounts a token for it.",
            _LABELS,
            "azure.workload.identity/use",
            "true",
        ),
        (
            "another network",
            "Multus gives the pod an interface past all NetworkPolicies.",
            _ANNOTATIONS,
            "k8s.v1.cni.cncf.io/networks",
            "kube-system/storage",
        ),
        (
            "another default network",
            "Multus takes the pod out of the cluster's own.",
            _ANNOTATIONS,
            "v1.multus-cni.io/default-network",
            "kube-system/storage",
        ),
        (
            "an address",
            "Calico gives the pod the address that a firewall lets through.",
            _ANNOTATIONS,
            "cni.projectcalico.org/ipAddrs",
            '["10.0.0.10"]',
        ),
        (
            "more bandwidth",
            "The bandwidth plugin takes the bandwidth from other pods.",
            _ANNOTATIONS,
            "kubernetes.io/egress-bandwidth",
            "100G",
        ),
        (
            "a container of Vault's",
            "Vault's injector adds an agent that logs in.",
            _ANNOTATIONS,
            "vault.hashicorp.com/agent-inject",
            "true",
        ),
        (
            "a secret of Vault's",
            "Vault's agent writes the secret into the pod.",
            _ANNOTATIONS,
            "vault.hashicorp.com/agent-inject-secret-admin",
            "secret/admin",
        ),
        (
            "a volume of Istio's proxy",
            "Istio's injector mounts a folder of the node.",
            _ANNOTATIONS,
            "sidecar.istio.io/userVolume",
            '{"node": {"hostPath": {"path": "/"}}}',
        ),
        (
            "an image of Istio's proxy",
            "Istio's injector adds a container with capabilities, from any image.",
            _ANNOTATIONS,
            "sidecar.istio.io/proxyImage",
            "mine:1",
        ),
        (
            "Istio's proxy",
            "The pod gets an identity in the mesh.",
            _LABELS,
            "sidecar.istio.io/inject",
            "true",
        ),
        (
            "the runtime's devices",
            "CRI-O gives the container a device of the node.",
            _ANNOTATIONS,
            "io.kubernetes.cri-o.Devices",
            "/dev/mem",
        ),
        (
            "a node that is never emptied",
            "The autoscaler keeps the pod's node for ever.",
            _ANNOTATIONS,
            "cluster-autoscaler.kubernetes.io/safe-to-evict",
            "false",
        ),
        (
            "an app's label under a domain",
            "Another team's policy that selects this label admits the pod.",
            _LABELS,
            "example.com/app",
            "database",
        ),
    )
)
