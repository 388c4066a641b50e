"""Queue, priority, nodes and metadata of the pods; `palaestra run` ignores these settings."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.fields import FreeObject, LabelMap, Listed, ObjectName, TextMap
from palaestra.api.model import ApiModel, Rule


class TolerationOperator(StrEnum):
    """How a toleration matches a taint."""

    EXISTS = "Exists"
    EQUAL = "Equal"


class TaintEffect(StrEnum):
    """Effect of a taint on pods that do not tolerate it."""

    NO_SCHEDULE = "NoSchedule"
    PREFER_NO_SCHEDULE = "PreferNoSchedule"
    NO_EXECUTE = "NoExecute"


class Toleration(ApiModel):
    """A node taint that the pods tolerate, as in a pod."""

    key: Annotated[str, Field(min_length=1, max_length=317)]
    """Key of the taint."""

    operator: TolerationOperator = Field(default=TolerationOperator.EQUAL, strict=False)
    """`Exists` tolerates any value of the taint; `Equal` tolerates only `value`."""

    value: Annotated[str, Field(max_length=63)] | None = None
    """Value of the taint; absent with `Exists`."""

    effect: TaintEffect | None = Field(default=None, strict=False)
    """Effect of the taint; absent: any."""

    toleration_seconds: Annotated[int, Field(ge=0, le=31_536_000)] | None = None
    """Seconds that a `NoExecute` taint is tolerated; absent: forever."""

    rules = (
        Rule(
            field="key",
            holds=lambda toleration: not toleration.key.startswith("node-role.kubernetes.io/"),
            cel="!self.key.startsWith('node-role.kubernetes.io/')",
            message="is a taint that reserves nodes for the cluster's own components; remove it",
        ),
        Rule(
            field="value",
            holds=lambda toleration: (
                toleration.value is None or toleration.operator is TolerationOperator.EQUAL
            ),
            cel="!has(self.value) || self.operator == 'Equal'",
            message="has no effect with operator Exists; remove it or use Equal",
        ),
        Rule(
            field="tolerationSeconds",
            holds=lambda toleration: (
                toleration.toleration_seconds is None or toleration.effect is TaintEffect.NO_EXECUTE
            ),
            cel="!has(self.tolerationSeconds) || (has(self.effect) && self.effect == 'NoExecute')",
            message="requires effect NoExecute; set that effect or remove it",
        ),
    )


def _has_no_reserved_key(keys: dict[str, str]) -> bool:
    return not any(key.startswith(("palaestra.dev/", "kueue.x-k8s.io/")) for key in keys)


def _domain(key: str) -> str:
    domain, slash, _ = key.partition("/")
    return domain if slash else ""


def _has_foreign_domain(key: str) -> bool:
    """Return whether a key has a domain, and the domain does not belong to Kubernetes."""
    return _domain(key) != "" and not _domain(key).endswith(("kubernetes.io", "k8s.io"))


def _selects_security_profile(key: str) -> bool:
    """Return whether an annotation selects a seccomp or AppArmor profile. Kubelets still obey AppArmor's."""
    return "security" in _domain(key) and _domain(key).endswith(".kubernetes.io")


class Scheduling(ApiModel):
    """Queue, priority, nodes and metadata of the pods."""

    queue_name: ObjectName | None = None
    """Name of a LocalQueue of Kueue; Kueue then starts and suspends the job. Absent: the job starts without a
    queue."""

    priority_class_name: ObjectName | None = None
    """Priority class of the pods, not one that begins with `system-`; absent: the cluster's default. The
    cluster's installation must allow it (`jobs.allowedPriorityClasses`)."""

    node_selector: LabelMap = Field(default={})
    """Labels that a node must have."""

    tolerations: Annotated[Listed[Toleration], Field(max_length=16)] = ()
    """Node taints that the pods tolerate. The cluster's installation must allow each key
    (`jobs.allowedTolerations`), unless the key is the name of an extended resource that the job requests."""

    affinity: FreeObject = Field(default={})
    """Affinity of the pods, in the format of a pod's spec. An affinity to other pods may select only pods in
    the job's own namespace. A required anti-affinity may select only pods of the job itself
    (`palaestra.dev/job: NAME`). The cluster's installation can allow more (`jobs.allowedAffinityNamespaces`,
    `jobs.allowedAntiAffinityLabels`)."""

    runtime_class_name: ObjectName | None = None
    """Runtime class of the pods, such as `nvidia`; absent: the cluster's default. The cluster's installation
    must allow it (`jobs.allowedRuntimeClasses`)."""

    pod_labels: LabelMap = Field(default={})
    """Additional pod labels. Each key needs a domain of yours, such as `example.com/team`: Services and
    NetworkPolicies of other users may select pods by a label without a domain. The cluster's installation
    must allow each key (`jobs.allowedPodLabels`)."""

    pod_annotations: TextMap = Field(default={})
    """Additional pod annotations. The cluster's installation must allow each key
    (`jobs.allowedPodAnnotations`)."""

    rules = (
        Rule(
            field="priorityClassName",
            holds=lambda scheduling: not (scheduling.priority_class_name or "").startswith("system-"),
            cel="!has(self.priorityClassName) || !self.priorityClassName.startsWith('system-')",
            message="classes that begin with system- are for the cluster's own components; choose another",
        ),
        Rule(
            field="podLabels",
            holds=lambda scheduling: all(_has_foreign_domain(key) for key in scheduling.pod_labels),
            cel="self.podLabels.all(key, key.contains('/') && !key.startsWith('/')"
            " && !key.split('/')[0].endsWith('kubernetes.io') && !key.split('/')[0].endsWith('k8s.io'))",
            message="Services and NetworkPolicies of other users may select pods by a label without your"
            " domain; use a key such as example.com/team",
        ),
        Rule(
            field="podAnnotations",
            holds=lambda scheduling: (
                not any(_selects_security_profile(key) for key in scheduling.pod_annotations)
            ),
            cel="!self.podAnnotations.exists(key, key.contains('/') && key.split('/')[0].contains('security')"
            " && key.split('/')[0].endsWith('.kubernetes.io'))",
            message="a job must not select AppArmor or seccomp profiles; remove those annotations",
        ),
        Rule(
            field="podLabels",
            holds=lambda scheduling: _has_no_reserved_key(scheduling.pod_labels),
            cel="self.podLabels.all(key, !key.startsWith('palaestra.dev/')"
            " && !key.startsWith('kueue.x-k8s.io/'))",
            message="Palaestra sets the keys of palaestra.dev and kueue.x-k8s.io; remove them",
        ),
        Rule(
            field="podAnnotations",
            holds=lambda scheduling: _has_no_reserved_key(scheduling.pod_annotations),
            cel="self.podAnnotations.all(key, !key.startsWith('palaestra.dev/')"
            " && !key.startsWith('kueue.x-k8s.io/'))",
            message="Palaestra sets the keys of palaestra.dev and kueue.x-k8s.io; remove them",
        ),
    )
