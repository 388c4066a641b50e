"""Requests and TrainingJobs by which a user who may not create pods could gain permissions.

This module contains only data. tests/e2e/test_escalations.py tests the outcomes.
"""

import copy
from typing import Any, NamedTuple

from tests.e2e.cluster import Object
from tests.e2e.jobs import tiny_job
from tests.e2e.namespace import SYSTEM

CORE, BATCH = "api/v1/namespaces/{namespace}", "apis/batch/v1/namespaces/{namespace}"
RBAC = "apis/rbac.authorization.k8s.io/v1/namespaces/{namespace}"
JOBS = "apis/palaestra.dev/v1alpha1/namespaces/{namespace}/trainingjobs"
OPERATOR = {"kind": "ServiceAccount", "name": "palaestra-operator", "namespace": SYSTEM}
SECRETS = {"apiGroup": "rbac.authorization.k8s.io", "kind": "ClusterRole", "name": "palaestra-job-secrets"}
POD = {"containers": [{"name": "c", "image": "i", "securityContext": {"privileged": True}}]}
HOST = [{"name": "node", "hostPath": {"path": "/"}}]


class Request(NamedTuple):
    """A request for an object other than a TrainingJob.

    `where` is relative to the API's root, and `{namespace}` in it is the user's own namespace. `gain` is what
    the user would gain.
    """

    name: str
    gain: str
    method: str
    where: str
    content: Object | None


class Field(NamedTuple):
    """A field of a TrainingJob at a path such as `spec.simulators.0.name`, and the expected message.

    `gain` is what the user would gain if the field had its effect.
    """

    name: str
    gain: str
    path: str
    value: Any
    told: str = ""


# RBAC denies these requests to the user.
REQUESTS = (
    Request(
        "a pod",
        "Runs with any privileges.",
        "POST",
        f"{CORE}/pods",
        {"metadata": {"name": "own"}, "spec": POD},
    ),
    Request(
        "a Job",
        "Creates pods with any privileges.",
        "POST",
        f"{BATCH}/jobs",
        {"metadata": {"name": "own"}, "spec": {"template": {"spec": POD | {"restartPolicy": "Never"}}}},
    ),
    Request(
        "a TrainingJob elsewhere",
        "Uses another team's quota.",
        "POST",
        "apis/palaestra.dev/v1alpha1/namespaces/default/trainingjobs",
        tiny_job("own"),
    ),
    Request("a secret by name", "Reads another user's password.", "GET", f"{CORE}/secrets/words", None),
    Request(
        "a container in a pod that runs",
        "Acts with the pod's permissions.",
        "PATCH",
        f"{CORE}/pods/any/ephemeralcontainers",
        {"spec": {"ephemeralContainers": [{"name": "own", "image": "i"}]}},
    ),
    Request(
        "the operator's token",
        "Acts in all namespaces.",
        "POST",
        f"api/v1/namespaces/{SYSTEM}/serviceaccounts/palaestra-operator/token",
        {"spec": {}},
    ),
    Request(
        "the right to read secrets",
        "Lets jobs use every secret.",
        "POST",
        f"{RBAC}/rolebindings",
        {"metadata": {"name": "own"}, "roleRef": SECRETS, "subjects": [OPERATOR]},
    ),
    Request(
        "the label of what is for jobs",
        "Opens a volume.",
        "PATCH",
        f"{CORE}/persistentvolumeclaims/kept",
        {"metadata": {"labels": {"palaestra.dev/for-jobs": "true"}}},
    ),
    Request(
        "a status by hand",
        "Reports that a run succeeded or never began.",
        "PATCH",
        f"{JOBS}/plain/status",
        {"status": {"phase": "Succeeded"}},
    ),
    Request(
        "the mark that stops a replica",
        "Ends another user's training.",
        "PATCH",
        f"{BATCH}/jobs/plain-0",
        {
            "metadata": {"annotations": {"palaestra.dev/stopped": "Stalled: now"}},
            "spec": {"activeDeadlineSeconds": 1},
        },
    ),
)

# The schema of a TrainingJob rejects these fields.
REFUSED = (
    Field(
        "the cluster's own priority",
        "Evicts the pods of all other users.",
        "spec.scheduling.priorityClassName",
        "system-node-critical",
        "classes that begin with system- are for the cluster's own components",
    ),
    Field(
        "a control plane's taint",
        "Runs on nodes that hold the cluster's credentials.",
        "spec.scheduling.tolerations",
        [{"key": "node-role.kubernetes.io/control-plane", "operator": "Exists"}],
        "is a taint that reserves nodes for the cluster's own components",
    ),
    Field(
        "every taint",
        "Tolerates the taints of control planes too.",
        "spec.scheduling.tolerations",
        [{"operator": "Exists"}],
        "spec.scheduling.tolerations[0].key: Required value",
    ),
    Field(
        "the label of an app",
        "A Service sends the app's requests to this pod, and a NetworkPolicy admits the pod.",
        "spec.scheduling.podLabels",
        {"app": "database"},
        "use a key such as example.com/team",
    ),
    Field(
        "the name of an app",
        "The same gain, by the recommended label.",
        "spec.scheduling.podLabels",
        {"app.kubernetes.io/name": "database"},
        "use a key such as example.com/team",
    ),
    Field(
        "an operator's label",
        "Trainers of all namespaces accept connections from an operator.",
        "spec.scheduling.podLabels",
        {"palaestra.dev/operator": "true"},
        "Palaestra sets the keys of",
    ),
    Field(
        "Kueue's label",
        "Bypasses the queue, or uses another team's quota.",
        "spec.scheduling.podLabels",
        {"kueue.x-k8s.io/queue-name": "theirs"},
        "Palaestra sets the keys of",
    ),
    Field(
        "no AppArmor",
        "The kernel confines the pod less.",
        "spec.scheduling.podAnnotations",
        {"container.apparmor.security.beta.kubernetes.io/trainer": "unconfined"},
        "a job must not select AppArmor or seccomp profiles",
    ),
    Field(
        "a claim elsewhere",
        "Writes to another namespace's volume.",
        "spec.storage.existingClaim",
        "other/kept",
        "spec.storage.existingClaim",
    ),
    Field(
        "a ConfigMap elsewhere",
        "Reads another namespace's configuration.",
        "spec.simulators.0.world",
        {"configMap": {"name": "../other/config", "key": "w"}},
        "world.configMap.name",
    ),
    Field(
        "a pull secret elsewhere",
        "Pulls images with another namespace's credentials.",
        "spec.imagePullSecrets",
        [{"name": "other/registry"}],
        "spec.imagePullSecrets[0].name",
    ),
    Field(
        "a run outside of the volume's folders",
        "Reads the files of another run.",
        "spec.storage",
        {"existingClaim": "kept", "resumeFrom": "../other"},
        "spec.storage.resumeFrom",
    ),
    Field(
        "a name that ends a node of a world",
        "Adds text to the world file.",
        "spec.simulators.0.name",
        'a" } Robot { name "b',
        "spec.simulators[0].name",
    ),
    Field(
        "a name with a second line",
        "Adds a line to training.yaml.",
        "spec.simulators.0.name",
        "a\nb",
        "spec.simulators[0].name",
    ),
    Field(
        "a password in an address",
        "Shows the password to every reader of TrainingJobs.",
        "spec.trainer.env",
        [{"name": "MLFLOW_TRACKING_URI", "value": "http://me:secret@tracking.example.com"}],
        "contains a password in an address",
    ),
    Field(
        "a master elsewhere",
        "Replaces a variable that the operator sets.",
        "spec.trainer.env",
        [{"name": "ROS_MASTER_URI", "value": "http://other"}],
        "Palaestra sets the variables",
    ),
)

# A TrainingJob has no such field: a strict client gets an error, and for other clients the field is dropped.
UNKNOWN = (
    Field("a folder of the node", "Reads and writes the node's files.", "spec.trainer.volumes", HOST),
    Field(
        "a privileged container",
        "Has root permissions on the node.",
        "spec.trainer.securityContext",
        {"privileged": True, "runAsUser": 0},
    ),
    Field("the node's network", "Reads the node's network traffic.", "spec.scheduling.hostNetwork", True),
    Field(
        "a service account", "Sends requests with the account's rights.", "spec.serviceAccountName", "default"
    ),
    Field(
        "a node by name",
        "Bypasses the scheduler, and the taints and quotas of nodes.",
        "spec.scheduling.nodeName",
        "palaestra-control-plane",
    ),
    Field(
        "a whole pod",
        "Combines all of the above.",
        "spec.template",
        {"spec": {**POD, "hostPID": True, "volumes": HOST}},
    ),
)

_APART = "spec.scheduling.affinity"
_REQUIRED = "requiredDuringSchedulingIgnoredDuringExecution"

# The API server accepts these TrainingJobs, but the operator holds them, because no administrator has opened
# the named objects to jobs or allowed the requested fields.
HELD = (
    Field(
        "a cluster of its own",
        "Keeps the pods of all tenants off every node.",
        _APART,
        {
            "podAntiAffinity": {
                _REQUIRED: [{"labelSelector": {}, "namespaceSelector": {}, "topologyKey": "kubernetes.io/os"}]
            }
        },
        "SchedulingNotAllowed",
    ),
    Field(
        "a node of its own",
        "Keeps the pods of its namespace off a node.",
        _APART,
        {"podAntiAffinity": {_REQUIRED: [{"labelSelector": {}, "topologyKey": "kubernetes.io/hostname"}]}},
        "SchedulingNotAllowed",
    ),
    Field(
        "a priority",
        "Evicts the pods of other users.",
        "spec.scheduling.priorityClassName",
        "production",
        "SchedulingNotAllowed",
    ),
    Field(
        "a runtime",
        "Isolates its containers less, or gives them devices.",
        "spec.scheduling.runtimeClassName",
        "kata",
        "SchedulingNotAllowed",
    ),
    Field(
        "nodes of another team",
        "Uses nodes that a taint reserves.",
        "spec.scheduling.tolerations",
        [{"key": "dedicated", "operator": "Exists"}],
        "SchedulingNotAllowed",
    ),
    Field(
        "a secret of this namespace",
        "Reads the secret's value in the pod's environment.",
        "spec.trainer.env",
        [{"name": "WORD", "secretKeyRef": {"name": "words", "key": "word"}}],
        "SecretNotForJobs",
    ),
    Field(
        "a pull secret of this namespace",
        "Runs private images, and reads their content.",
        "spec.imagePullSecrets",
        [{"name": "words"}],
        "SecretNotForJobs",
    ),
    Field(
        "a ConfigMap of this namespace",
        "Reads the ConfigMap's text in the replica's ConfigMap.",
        "spec.simulators.0.world",
        {"configMap": {"name": "settings", "key": "text"}},
        "ConfigMapNotForJobs",
    ),
    Field(
        "a claim of this namespace",
        "Reads the claim's files in the pod.",
        "spec.storage",
        {"existingClaim": "kept"},
        "ClaimNotForJobs",
    ),
    Field(
        "a file of the node in a world",
        "Reads the file's text in the simulator.",
        "spec.simulators.0.world",
        {"inline": '#VRML_SIM R2023b utf8\nEXTERNPROTO "../../etc/shadow.proto"\nWorldInfo {}\n'},
        "WorldInvalid",
    ),
)


def authors(name: str, *fields: tuple[str, Any]) -> Object:
    """Return a suspended TrainingJob with fields set by path; the tests need no running pod."""
    job = tiny_job(name, script="exit 0", suspend=True)
    for path, value in fields:
        *above, last = path.split(".")
        inside: Any = job
        for step in above:
            inside = inside[int(step)] if isinstance(inside, list) else inside.setdefault(step, {})
        inside[last] = copy.deepcopy(value)
    return job
