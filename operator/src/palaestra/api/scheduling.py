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

    key: Annotated[str, Field(max_length=317)] | None = None
    """Key of the taint; absent: any, with operator `Exists`."""

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
            holds=lambda it: it.key is not None or it.operator is TolerationOperator.EXISTS,
            cel="has(self.key) || self.operator == 'Exists'",
            message="is missing; name the taint's key, or use operator Exists",
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


class Scheduling(ApiModel):
    """Where and when the pods run."""

    queue_name: ObjectName | None = None
    """Kueue's queue, which then starts and suspends the job; absent: Kubernetes starts it."""

    priority_class_name: ObjectName | None = None
    """Priority class of the pods; absent: the cluster's default."""

    node_selector: LabelMap = Field(default={})
    """Labels that a node must have."""

    tolerations: Annotated[Listed[Toleration], Field(max_length=16)] = ()
    """Taints of nodes that the pods tolerate."""

    affinity: FreeObject = Field(default={})
    """Affinity of the pods, as in a pod."""

    runtime_class_name: ObjectName | None = None
    """Runtime class of the pods, such as `nvidia`; absent: the cluster's default."""

    pod_labels: LabelMap = Field(default={})
    """Labels for the pods, beside Palaestra's own."""

    pod_annotations: TextMap = Field(default={})
    """Annotations for the pods, beside Palaestra's own."""

    rules = (
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
