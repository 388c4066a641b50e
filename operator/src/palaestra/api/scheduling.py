"""Where and when the pods run. Nothing here is used by `palaestra run`."""

from enum import StrEnum
from typing import Annotated

from pydantic import Field

from palaestra.api.fields import FreeObject, LabelMap, Listed, ObjectName, TextMap
from palaestra.api.model import ApiModel, Rule


class TolerationOperator(StrEnum):
    """How a toleration is compared with a taint."""

    EXISTS = "Exists"
    EQUAL = "Equal"


class TaintEffect(StrEnum):
    """What a taint does to pods that do not tolerate it."""

    NO_SCHEDULE = "NoSchedule"
    PREFER_NO_SCHEDULE = "PreferNoSchedule"
    NO_EXECUTE = "NoExecute"


class Toleration(ApiModel):
    """A taint of nodes that the pods tolerate, as in a pod."""

    key: Annotated[str, Field(min_length=1, max_length=317)]
    """Key of the taint."""

    operator: TolerationOperator = Field(default=TolerationOperator.EQUAL, strict=False)
    """`Exists`: any value. `Equal`: the value below."""

    value: Annotated[str, Field(max_length=63)] | None = None
    """Value of the taint; absent with `Exists`."""

    effect: TaintEffect | None = Field(default=None, strict=False)
    """Effect of the taint; absent: any."""

    toleration_seconds: Annotated[int, Field(ge=0, le=31_536_000)] | None = None
    """Seconds that a `NoExecute` taint is tolerated; absent: for ever."""

    rules = (
        Rule(
            field="key",
            holds=lambda it: not it.key.startswith("node-role.kubernetes.io/"),
            cel="!self.key.startsWith('node-role.kubernetes.io/')",
            message="keeps nodes free for the cluster's own parts; remove it",
        ),
        Rule(
            field="value",
            holds=lambda it: it.value is None or it.operator is TolerationOperator.EQUAL,
            cel="!has(self.value) || self.operator == 'Equal'",
            message="operator Exists compares no value; remove it or use Equal",
        ),
        Rule(
            field="tolerationSeconds",
            holds=lambda it: it.toleration_seconds is None or it.effect is TaintEffect.NO_EXECUTE,
            cel="!has(self.tolerationSeconds) || (has(self.effect) && self.effect == 'NoExecute')",
            message="belongs to effect NoExecute; set that effect or remove it",
        ),
    )


def _has_none_of_ours(keys: dict[str, str]) -> bool:
    return not any(key.startswith(("palaestra.dev/", "kueue.x-k8s.io/")) for key in keys)


def _domain(key: str) -> str:
    domain, slash, _ = key.partition("/")
    return domain if slash else ""


def _is_selected_by_nobody(key: str) -> bool:
    """Return whether a label is under a domain, and not under one of Kubernetes'."""
    return _domain(key) != "" and not _domain(key).endswith(("kubernetes.io", "k8s.io"))


def _confines(key: str) -> bool:
    """Return whether an annotation chooses a profile of seccomp, or of AppArmor, which is still obeyed."""
    return "security" in _domain(key) and _domain(key).endswith(".kubernetes.io")


class Scheduling(ApiModel):
    """Where and when the pods run."""

    queue_name: ObjectName | None = None
    """Kueue's queue, which then starts and suspends the job; absent: Kubernetes starts it."""

    priority_class_name: ObjectName | None = None
    """Priority class of the pods, none of Kubernetes' own; absent: the cluster's default."""

    node_selector: LabelMap = Field(default={})
    """Labels that a node must have."""

    tolerations: Annotated[Listed[Toleration], Field(max_length=16)] = ()
    """Taints of nodes that the pods tolerate."""

    affinity: FreeObject = Field(default={})
    """Affinity of the pods, as in a pod."""

    runtime_class_name: ObjectName | None = None
    """Runtime class of the pods, such as `nvidia`; absent: the cluster's default."""

    pod_labels: LabelMap = Field(default={})
    """Labels for the pods, beside Palaestra's own, under a domain of yours such as `example.com/team`:
    Services and NetworkPolicies of others select pods by the usual ones. A cluster takes those that its
    installation allows (`jobs.allowedPodLabels`)."""

    pod_annotations: TextMap = Field(default={})
    """Annotations for the pods, beside Palaestra's own. A cluster takes those that its installation allows
    (`jobs.allowedPodAnnotations`)."""

    rules = (
        Rule(
            field="priorityClassName",
            holds=lambda it: not (it.priority_class_name or "").startswith("system-"),
            cel="!has(self.priorityClassName) || !self.priorityClassName.startsWith('system-')",
            message="classes that begin with system- are for the cluster's own parts; choose another",
        ),
        Rule(
            field="podLabels",
            holds=lambda it: all(_is_selected_by_nobody(key) for key in it.pod_labels),
            cel="self.podLabels.all(key, key.contains('/') && !key.startsWith('/')"
            " && !key.split('/')[0].endsWith('kubernetes.io') && !key.split('/')[0].endsWith('k8s.io'))",
            message="others may select pods by such a label; put a domain of yours before it, "
            "as example.com/team",
        ),
        Rule(
            field="podAnnotations",
            holds=lambda it: not any(_confines(key) for key in it.pod_annotations),
            cel="!self.podAnnotations.exists(key, key.contains('/') && key.split('/')[0].contains('security')"
            " && key.split('/')[0].endsWith('.kubernetes.io'))",
            message="how a pod is confined is not the job's to say; remove what is about AppArmor or seccomp",
        ),
        Rule(
            field="podLabels",
            holds=lambda it: _has_none_of_ours(it.pod_labels),
            cel="self.podLabels.all(key, !key.startsWith('palaestra.dev/')"
            " && !key.startsWith('kueue.x-k8s.io/'))",
            message="keys of palaestra.dev and kueue.x-k8s.io are set by Palaestra; remove them",
        ),
        Rule(
            field="podAnnotations",
            holds=lambda it: _has_none_of_ours(it.pod_annotations),
            cel="self.podAnnotations.all(key, !key.startsWith('palaestra.dev/')"
            " && !key.startsWith('kueue.x-k8s.io/'))",
            message="keys of palaestra.dev and kueue.x-k8s.io are set by Palaestra; remove them",
        ),
    )
