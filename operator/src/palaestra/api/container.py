"""Environment variables and resources of the pod's containers."""

from typing import Annotated

from pydantic import Field

from palaestra.api.fields import VARIABLE, FileKey, NamedList, ObjectName, Quantities, Sentence
from palaestra.api.model import ApiModel, Rule
from palaestra.api.passwords import NO_PASSWORD_IN_VALUE


class SecretKey(ApiModel):
    """A key of a Secret in the job's own namespace.

    The Secret must have the label `palaestra.dev/for-jobs: "true"`. Otherwise an author of TrainingJobs could
    read Secrets to which they have no access.
    """

    name: ObjectName
    """Name of the Secret."""

    key: FileKey
    """Key in the Secret's data."""


class Variable(ApiModel):
    """An environment variable: a value, or a reference to a Secret's key."""

    name: Annotated[str, Field(min_length=1, max_length=128, pattern=VARIABLE)]
    """Name of the variable."""

    value: Sentence | None = None
    """Value of the variable; absent if `secretKeyRef` is set. `$(OTHER)` is not expanded. In a cluster, an
    address with a password is refused."""

    secret_key_ref: SecretKey | None = None
    """Key of a Secret that contains the value; absent if `value` is set."""

    rules = (
        Rule(
            holds=lambda variable: (variable.value is None) != (variable.secret_key_ref is None),
            cel="has(self.value) != has(self.secretKeyRef)",
            message="needs exactly one of value and secretKeyRef; set one of them",
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
                "Palaestra sets the variables that begin with PALAESTRA_ (except PALAESTRA_STUB_) or ROS_; "
                "choose another name"
            ),
        ),
    )
    guards = (NO_PASSWORD_IN_VALUE,)


Environment = Annotated[NamedList[Variable], Field(max_length=32)]


class Resources(ApiModel):
    """CPU, memory and devices of one container, as in a pod."""

    requests: Quantities = Field(default={})
    """Resource requests of the container (`cpu`, `memory`, ...); default: those of the installation, or else
    Palaestra's own small requests."""

    limits: Quantities = Field(default={})
    """Resource limits of the container; the CPU limit also sets PyTorch's number of threads. If `requests`
    names CPU or memory and `limits` does not, the default limit stays, or is raised to the request if the
    request is larger."""
