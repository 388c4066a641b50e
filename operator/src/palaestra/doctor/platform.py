"""Checks of the cluster: version, definition of TrainingJobs, namespace, sidecars and storage."""

import re
from collections.abc import Iterator, Mapping
from importlib.metadata import version
from typing import Any

from palaestra.api.crd import crd
from palaestra.api.job import API_VERSION
from palaestra.client.errors import INSTALL
from palaestra.cluster import Forbidden, Invalid, NotFound
from palaestra.cluster.resources import DEFINITIONS, NAMESPACES, NODES, PODS, STORAGE_CLASSES
from palaestra.doctor.check_result import CheckResult, Site, right, unknown, wrong
from palaestra.doctor.installation import trainer_image
from palaestra.objects import Object
from palaestra.plan.containers import SECURITY
from palaestra.plan.pod import UNPRIVILEGED

# All limits are set, because a quota may refuse a pod that lacks a limit. The values are small.
RESOURCES = {
    "requests": {"cpu": "10m", "memory": "32Mi"},
    "limits": {"cpu": "10m", "memory": "96Mi"},
}

FIRST = (1, 33)  # the first version of Kubernetes in which sidecar containers are stable
DEFAULT_CLASS = "storageclass.kubernetes.io/is-default-class"
OVER_QUOTA = "exceeded quota"


def answers(site: Site) -> Iterator[CheckResult]:
    """Check whether the API server responds and supports sidecar containers."""
    yield judged_version("API server", site.api.version())


def nodes(site: Site) -> Iterator[CheckResult]:
    """Check whether the oldest kubelet supports sidecar containers."""
    versions = [node["status"]["nodeInfo"]["kubeletVersion"] for node in site.api.list(NODES)]
    if not versions:
        yield wrong("nodes", "the cluster has no nodes", "add a node, so that pods can run")
        return
    yield judged_version("nodes", min(versions, key=release))


def judged_version(what: str, text: str) -> CheckResult:
    """Return the result for a version such as `v1.33.2+k3s1`: whether it supports sidecar containers."""
    if release(text) < FIRST:
        fact = f"{text} is older than 1.33, the first version with stable sidecar containers"
        return wrong(what, fact, "update to 1.33 or newer")
    return right(what, f"{text} supports sidecar containers")


def release(text: str) -> tuple[int, int]:
    """Return major and minor of a version; (0, 0) if `text` is not a version."""
    found = re.match(r"v?(\d+)\.(\d+)", text)
    return (int(found[1]), int(found[2])) if found else (0, 0)


def definition(site: Site) -> Iterator[CheckResult]:
    """Check whether the cluster serves TrainingJobs with the definition of this release."""
    what, remedy = "TrainingJobs", INSTALL
    if not site.api.serves(API_VERSION):
        yield wrong(what, f"the cluster does not serve {API_VERSION}", remedy)
        return
    ours = crd()
    found = site.api.get(DEFINITIONS, None, ours["metadata"]["name"])
    place = difference(ours["spec"], found["spec"], "spec")
    if place:
        yield wrong(
            what,
            f"their CustomResourceDefinition differs from the definition of release {version('palaestra')} "
            f"in {place}",
            f"{remedy}, or use the command line of the installed release",
        )
    else:
        yield right(what, f"have the definition of {version('palaestra')}")


def namespace(site: Site) -> Iterator[CheckResult]:
    """Check whether the namespace of the jobs exists."""
    what, name = "namespace", site.namespace
    try:
        site.api.get(NAMESPACES, None, name)
    except NotFound:
        remedy = f"`kubectl create namespace {name}`, or choose one of `kubectl get namespaces` with -n"
        yield wrong(what, f"{name} does not exist", remedy)
    else:
        yield right(what, f"{name} exists")


def difference(ours: Any, found: Any, path: str) -> str | None:
    """Return the path of the first value in `ours` that differs in `found`, or None.

    Additional values in `found` are ignored.
    """
    if isinstance(ours, Mapping) and isinstance(found, Mapping):
        pairs = [(f"{path}.{key}", value, found.get(key)) for key, value in ours.items()]
    elif isinstance(ours, list) and isinstance(found, list) and len(ours) == len(found):
        pairs = [(f"{path}[{i}]", *pair) for i, pair in enumerate(zip(ours, found, strict=True))]
    else:
        return None if ours == found else path
    return next((place for name, one, other in pairs if (place := difference(one, other, name))), None)


def sidecars(site: Site) -> Iterator[CheckResult]:
    """Check by a dry run whether the API server admits a pod without a change of its sidecars."""
    what = "sidecars"
    try:
        made = site.api.create(PODS, trial_pod(site.namespace, trainer_image(site)), dry_run=True)
    except Forbidden as error:
        if error.lacks_right:
            raise
        if OVER_QUOTA in error.message:
            yield unknown(what, f"could not be checked: {error.message}", "try again when the quota has room")
            return
        yield wrong(
            what,
            f"a pod like the pods of jobs is refused in {site.namespace}: {error.message}",
            "allow what the message names",
        )
    except Invalid as error:  # the API server refuses a dry run if a webhook has side effects
        yield unknown(what, f"could not be checked: {error.message}", "start a job and read its status")
    else:
        yield judged_pod(made)


def judged_pod(made: Object) -> CheckResult:
    """Return the result for the pod of the dry run, as the API server returned it."""
    found = {
        container["name"]: container.get("restartPolicy")
        for container in made["spec"].get("initContainers", ())
    }
    if found.get("sidecar") == "Always":
        return right("sidecars", "stay unchanged when a pod is created")
    return wrong(
        "sidecars",
        "the cluster drops restartPolicy of init containers, so no pod of a job would become ready",
        "update or remove the mutating webhook: `kubectl get mutatingwebhookconfigurations`",
    )


def trial_pod(namespace: str, image: str) -> Object:
    """Return the pod of the dry run, which has one sidecar and meets *restricted* Pod Security."""
    common = {"image": image, "command": ["true"], "securityContext": SECURITY, "resources": RESOURCES}
    return {
        "apiVersion": "v1",
        "kind": "Pod",
        "metadata": {"name": "palaestra-doctor", "namespace": namespace},
        "spec": {
            "restartPolicy": "Never",
            "automountServiceAccountToken": False,
            "securityContext": UNPRIVILEGED,
            "initContainers": [{"name": "sidecar", "restartPolicy": "Always", **common}],
            "containers": [{"name": "trainer", **common}],
        },
    }


def storage(site: Site) -> Iterator[CheckResult]:
    """Check whether the cluster has a default storage class, which claims without a class get."""
    classes = site.api.list(STORAGE_CLASSES)
    default = [
        class_["metadata"]["name"]
        for class_ in classes
        if (class_["metadata"].get("annotations") or {}).get(DEFAULT_CLASS) == "true"
    ]
    if default:
        yield right("storage class", f"{default[0]} is the default")
        return
    names = ", ".join(class_["metadata"]["name"] for class_ in classes)
    yield wrong(
        "storage class",
        f"no class is the default; the classes are {names}" if names else "the cluster has no storage class",
        f"annotate one with {DEFAULT_CLASS}=true, or name one in spec.storage.storageClassName of each job",
    )
