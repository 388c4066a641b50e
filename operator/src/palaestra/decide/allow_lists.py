"""Check that the installation allows those settings of a job that affect other users of the cluster.

A job is checked until it is accepted, and never again. So an accepted job stays accepted if a newer release
adds a check or an administrator removes an allowed value. The schema of the CRD does not check affinities.
These checks skip a value of an unexpected type, and the API server refuses this value in a pod.
"""

from collections.abc import Callable, Iterable, Iterator, Mapping
from itertools import product
from typing import Any

from palaestra.api import TrainingJob
from palaestra.api.reasons import Reason
from palaestra.decide.explanation import Hold, held
from palaestra.plan import Allowed
from palaestra.plan.replica import JOB_LABEL, UID_LABEL
from palaestra.plan.resources import asks_for

Term = Mapping[str, Any]  # one term of an affinity to pods, in the format of a pod's spec
Check = Callable[[TrainingJob, Allowed], Hold | None]

REQUIRED = "requiredDuringSchedulingIgnoredDuringExecution"
PREFERRED = "preferredDuringSchedulingIgnoredDuringExecution"
STRENGTHS = (REQUIRED, PREFERRED)
ANTI_AFFINITY = "podAntiAffinity"
KINDS = ("podAffinity", ANTI_AFFINITY)


def pod_metadata_is_allowed(job: TrainingJob, allowed: Allowed) -> Hold | None:
    """Allow only listed keys, because other controllers act on labels and annotations of pods."""
    scheduling = job.spec.scheduling
    for field, value, keys, known in (
        ("podLabels", "allowedPodLabels", scheduling.pod_labels, allowed.pod_labels),
        ("podAnnotations", "allowedPodAnnotations", scheduling.pod_annotations, allowed.pod_annotations),
    ):
        if refused := [key for key in sorted(keys) if not _allows(known, key)]:
            where = f"spec.scheduling.{field}"
            return held(Reason.POD_METADATA_NOT_ALLOWED, field=where, key=refused[0], value=f"jobs.{value}")
    return None


def priority_is_allowed(job: TrainingJob, allowed: Allowed) -> Hold | None:
    """Allow only listed classes, because pods of a higher priority preempt the pods of other users."""
    name = job.spec.scheduling.priority_class_name
    if name is None or name in allowed.priority_classes:
        return None
    return _to_allow("priorityClassName", f"priority class {name}", "allowedPriorityClasses")


def runtime_is_allowed(job: TrainingJob, allowed: Allowed) -> Hold | None:
    """Allow only listed classes: another runtime may isolate a container less, or give it devices."""
    name = job.spec.scheduling.runtime_class_name
    if name is None or name in allowed.runtime_classes:
        return None
    return _to_allow("runtimeClassName", f"runtime class {name}", "allowedRuntimeClasses")


def tolerations_are_allowed(job: TrainingJob, allowed: Allowed) -> Hold | None:
    """Allow only listed taints and those of requested resources: others may reserve nodes for other users."""
    for place, toleration in enumerate(job.spec.scheduling.tolerations):
        if not (_allows(allowed.tolerations, toleration.key) or _requests(job, toleration.key)):
            field, fact = f"tolerations[{place}]", f"toleration of taint {toleration.key}"
            return _to_allow(field, fact, "allowedTolerations")
    return None


def affinity_stays_in_its_namespace(job: TrainingJob, allowed: Allowed) -> Hold | None:
    """Allow only listed namespaces: an affinity affects where its pods may run, and reveals their nodes."""
    known = (job.metadata.namespace, *allowed.affinity_namespaces)
    terms = (term for kind, strength in product(KINDS, STRENGTHS) for term in _terms(job, kind, strength))
    for where, term in terms:
        if term.get("namespaceSelector") is not None:
            remedy = "create a new TrainingJob that names the namespaces"
            return _not_allowed(f"{where}.namespaceSelector", "an affinity to selected namespaces", remedy)
        if refused := [name for name in _listed(term, "namespaces") if name not in known]:
            fact = f"affinity to pods of namespace {refused[0]}"
            return _to_allow(f"{where}.namespaces", fact, "allowedAffinityNamespaces")
    return None


def no_pods_of_others_are_kept_away(job: TrainingJob, allowed: Allowed) -> Hold | None:
    """Refuse a required anti-affinity to other pods, because it also keeps these pods off the job's nodes."""
    for where, term in _terms(job, ANTI_AFFINITY, REQUIRED):
        selector = term.get("labelSelector")
        if selector is not None and not _selects_own(job, term) and not _selects_allowed(selector, allowed):
            remedy = (
                f"create a new TrainingJob that selects its own pods by {JOB_LABEL}: {job.metadata.name}, or "
                "allow a label of the selector with the chart's value jobs.allowedAntiAffinityLabels"
            )
            fact = "a required anti-affinity to pods of other jobs"
            return _not_allowed(f"{where}.labelSelector", fact, remedy)
    return None


# All checks of a job against the installation's lists; the first refusal becomes the message.
CHECKS: tuple[Check, ...] = (
    pod_metadata_is_allowed,
    priority_is_allowed,
    runtime_is_allowed,
    tolerations_are_allowed,
    affinity_stays_in_its_namespace,
    no_pods_of_others_are_kept_away,
)


def not_allowed(job: TrainingJob, allowed: Allowed) -> Hold | None:
    """Return the hold for the first setting of a job that the installation does not allow."""
    return next((found for check in CHECKS if (found := check(job, allowed))), None)


def _to_allow(field: str, fact: str, value: str) -> Hold:
    remedy = f"allow it with the chart's value jobs.{value}, or create a new TrainingJob without it"
    return _not_allowed(field, fact, remedy)


def _not_allowed(field: str, fact: str, remedy: str) -> Hold:
    where = f"spec.scheduling.{field}"
    return held(Reason.SCHEDULING_NOT_ALLOWED, field=where, fact=fact, remedy=remedy)


def _allows(allowed: Iterable[str], key: str) -> bool:
    """Return whether `allowed` contains a key or its domain."""
    domain, slash, _ = key.partition("/")
    return key in allowed or (bool(slash) and f"{domain}/" in allowed)


def _requests(job: TrainingJob, resource: str) -> bool:
    """Return whether the job requests an extended resource, by the rule of ExtendedResourceToleration.

    ExtendedResourceToleration is an admission plugin of Kubernetes. A pod with such a request runs only on
    nodes that have the resource. Resources of the domain kubernetes.io do not count, because a scheduler
    ignores unknown resources of that domain.
    """
    if "/" not in resource or "kubernetes.io/" in resource:
        return False
    containers = (job.spec.trainer.resources, *(group.resources for group in job.spec.simulators))
    return any(asks_for(resource, wanted) for wanted in containers)


def _terms(job: TrainingJob, kind: str, strength: str) -> Iterator[tuple[str, Term]]:
    """Yield each term of an affinity to pods with its path below `spec.scheduling`."""
    for place, item in enumerate(_listed(job.spec.scheduling.affinity.get(kind), strength)):
        where = f"affinity.{kind}.{strength}[{place}]"
        if strength == PREFERRED:
            yield f"{where}.podAffinityTerm", _mapping(item, "podAffinityTerm")
        elif isinstance(item, Mapping):
            yield where, item


def _selects_own(job: TrainingJob, term: Term) -> bool:
    """Return whether a term selects only the job's own pods, by the job's label or by its uid."""
    own, selector = job.metadata.name, term.get("labelSelector")
    return (
        _mapping(selector, "matchLabels").get(JOB_LABEL) == own
        or any(
            (each.get("key"), each.get("operator"), each.get("values")) == (JOB_LABEL, "In", [own])
            for each in _expressions(selector)
        )
        or any(key in (JOB_LABEL, UID_LABEL) for key in _listed(term, "matchLabelKeys"))
    )


def _selects_allowed(selector: object, allowed: Allowed) -> bool:
    """Return whether a selector requires a label that the installation allows."""
    demanded = [
        *_mapping(selector, "matchLabels"),
        *(each.get("key") for each in _expressions(selector) if each.get("operator") in ("In", "Exists")),
    ]
    return any(_allows(allowed.anti_affinity_labels, str(key)) for key in demanded)


def _expressions(selector: object) -> Iterator[Mapping[str, Any]]:
    return (each for each in _listed(selector, "matchExpressions") if isinstance(each, Mapping))


def _mapping(raw: object, name: str) -> Mapping[str, Any]:
    """Return a mapping in untyped data; empty for any other value, which the API server refuses."""
    found = raw.get(name) if isinstance(raw, Mapping) else None
    return found if isinstance(found, Mapping) else {}


def _listed(raw: object, name: str) -> list[Any]:
    """Return a list in untyped data; empty for any other value, which the API server refuses."""
    found = raw.get(name) if isinstance(raw, Mapping) else None
    return found if isinstance(found, list) else []
