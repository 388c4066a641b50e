"""What a container of the pod may be given by the job: variables and resources."""

from typing import Annotated

from pydantic import Field

from palaestra.api.fields import VARIABLE, FileKey, NamedList, ObjectName, Quantities, Sentence
from palaestra.api.model import ApiModel, Rule


class SecretKey(ApiModel):
    """A key of a Secret in the job's own namespace.

    The Secret must carry the label `palaestra.dev/for-jobs: "true"`: a TrainingJob opens nothing
    that its author could not open before.
    """

    name: ObjectName
    """Name of the Secret."""

    key: FileKey
    """Key in the Secret's data."""


class Variable(ApiModel):
    """An environment variable: a value, or the key of a Secret that holds it."""

    name: Annotated[str, Field(min_length=1, max_length=128, pattern=VARIABLE)]
    """Name of the variable."""

    value: Sentence | None = None
    """Its value; absent when it comes from a Secret. No `$(OTHER)` is expanded in it."""

    secret_key_ref: SecretKey | None = None
    """Where its value is kept; absent when `value` is given."""

    rules = (
        Rule(
            holds=lambda variable: (variable.value is None) != (variable.secret_key_ref is None),
            cel="has(self.value) != has(self.secretKeyRef)",
            message="has both or neither of value and secretKeyRef; give one of them",
        ),
        Rule(
            field="name",
            holds=lambda variable: (
                variable.name.startswith("PALAESTRA_STUB_")
                or not variable.name.startswith(("PALAESTRA_", "ROS_"))
            ),
            cel=(
                "self.name.startsWith('PALAESTRA_STUB_') || "
                "!self.name.startsWith('PALAESTRA_') && !self.name.startsWith('ROS_')"
            ),
            message=(
                "names beginning with PALAESTRA_ or ROS_ are set by Palaestra, but for PALAESTRA_STUB_; "
                "choose another"
            ),
        ),
    )


Environment = Annotated[NamedList[Variable], Field(max_length=32)]


class Resources(ApiModel):
    """CPU, memory and devices of one container, as in a pod."""

    requests: Quantities = Field(default={})
    """What is set aside for the container, by resource (`cpu`, `memory`, ...); default: Palaestra's
    own small requests."""

    limits: Quantities = Field(default={})
    """What the container may use at most, by resource; the CPU limit sets the number of threads
    that PyTorch uses."""
