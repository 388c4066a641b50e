"""The fields that a person sets so that a quota on limits or a LimitRange admits the pods of a job.

The API server's message names containers, but a person sets fields. No field has the name of the ROS master's
container or of `install-sidecar`.
"""

import re

from palaestra.plan.replica import INSTALL_SIDECAR, ROS_MASTER, SIMULATOR_PREFIX, TRAINER

# These match the messages of Kubernetes' admission plugins ResourceQuota and LimitRanger.
_UNSPECIFIED = re.compile(r"must specify (?P<containers>.+)$")
_NAMES = re.compile(r"for: (?P<names>[a-z0-9,-]+)")
_SIZES = re.compile(r"\b(?:usage|ratio) per (?:Container|Pod) is ")

_EVERY = "spec.rosMaster.resources, spec.simulators[].resources and spec.trainer.resources"


def remedy_of(words: str) -> str:
    """Return the clause that names the fields, for the end of a message; "" for any other refusal."""
    if (unspecified := _UNSPECIFIED.search(words)) is not None:
        names = ",".join(_NAMES.findall(unspecified["containers"])).split(",")
        fields = " and ".join(sorted({field for name in names if (field := _field(name))}))
    else:
        fields = _EVERY if _SIZES.search(words) is not None else ""
    return f"; a new job sets {fields}, the chart sets jobs.resources for all jobs" if fields else ""


def _field(container: str) -> str:
    """Return the field with the resources of a container; "" if a webhook has added the container."""
    if container == TRAINER:
        return "spec.trainer.resources"
    if container in {ROS_MASTER, INSTALL_SIDECAR}:
        return "spec.rosMaster.resources"
    return "spec.simulators[].resources" if container.startswith(SIMULATOR_PREFIX) else ""
