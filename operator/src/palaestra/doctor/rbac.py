"""Checks of permissions, by access reviews of the API server and not by reading roles.

A test compares the table `OPERATOR` with the role that the chart installs.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from palaestra.cluster.resources import OWN_RIGHTS, RIGHTS
from palaestra.doctor.check_result import CheckResult, Site, right, unknown, wrong
from palaestra.objects import Object


@dataclass(frozen=True, slots=True, kw_only=True)
class Right:
    """The permission to use `verbs` on one resource, such as `pods` or `pods/log`."""

    group: str
    resource: str
    verbs: tuple[str, ...]

    def reviewed(self, namespace: str) -> Iterator[tuple[str, Object]]:
        """Yield, for each verb, a text such as `list pods` and the attributes of an access review."""
        plural, _, subresource = self.resource.partition("/")
        for verb in self.verbs:
            attributes = {"namespace": namespace, "group": self.group, "resource": plural, "verb": verb}
            if subresource:
                attributes["subresource"] = subresource
            yield f"{verb} {self.resource}", attributes


@dataclass(frozen=True, slots=True, kw_only=True)
class Account:
    """A service account."""

    namespace: str
    name: str

    @property
    def subject(self) -> Object:
        """Return the user and groups of the account in requests to the API server."""
        groups = ["system:serviceaccounts", f"system:serviceaccounts:{self.namespace}"]
        return {"user": f"system:serviceaccount:{self.namespace}:{self.name}", "groups": groups}


def may(group: str, resource: str, verbs: str) -> Right:
    """Return the permission to use `verbs`, which are separated by spaces."""
    return Right(group=group, resource=resource, verbs=tuple(verbs.split()))


OPERATOR = (
    may("palaestra.dev", "trainingjobs", "get list watch delete"),
    may("palaestra.dev", "trainingjobs/status", "patch"),
    may("palaestra.dev", "trainingjobs/finalizers", "update"),
    may("batch", "jobs", "get list watch create patch delete"),
    may("", "pods", "list watch"),
    may("", "pods/eviction", "create"),
    may("", "configmaps", "get list watch create"),
    may("", "persistentvolumeclaims", "get list watch create delete"),
    may("networking.k8s.io", "networkpolicies", "list watch create patch"),
    may("", "events", "get list create patch"),
)
# The operator uses this permission only for messages in a status, and works without it.
OPERATOR_WITH_KUEUE = (may("kueue.x-k8s.io", "workloads", "list"),)

TASKS: tuple[tuple[str, tuple[Right, ...]], ...] = (
    ("read jobs", (may("palaestra.dev", "trainingjobs", "get list watch"), may("", "events", "list"))),
    ("author jobs", (may("palaestra.dev", "trainingjobs", "create patch delete"),)),
    ("read logs", (may("", "pods/log", "get"),)),
    ("view simulators", (may("", "pods/proxy", "get"),)),
    (
        "fetch runs",
        (
            may("batch", "jobs", "get"),
            may("", "pods", "get list watch create delete"),
            may("", "pods/exec", "create get"),
        ),
    ),
)
# Only some users need the permissions for the other tasks.
NECESSARY = frozenset({"read jobs", "author jobs"})


def own_rights(site: Site) -> Iterator[CheckResult]:
    """Report the permissions that the user lacks, with one result for each task."""
    for task, rights in TASKS:
        denied = missing(site, rights)
        what = f"to {task}"
        if denied:
            report = wrong if task in NECESSARY else unknown
            yield report(
                what,
                f"you may not {', '.join(denied)} in {site.namespace}",
                "ask for a role with these rights; other tasks may work without them",
            )
        else:
            yield right(what, f"you have the rights in {site.namespace}")


def missing(site: Site, rights: Iterable[Right], *, account: Account | None = None) -> list[str]:
    """Return the permissions that the user, or `account`, lacks in the namespace, such as `list pods`."""
    return [
        text
        for needed in rights
        for text, attributes in needed.reviewed(site.namespace)
        if not allowed(site, attributes, account=account)
    ]


def allowed(site: Site, attributes: Object, *, account: Account | None = None) -> bool:
    """Return whether the user, or `account`, has the permission in `attributes`."""
    kind, subject = (OWN_RIGHTS, {}) if account is None else (RIGHTS, account.subject)
    review = {
        "apiVersion": kind.api_version,
        "kind": kind.kind,
        "metadata": {},
        "spec": {**subject, "resourceAttributes": attributes},
    }
    return bool(site.api.create(kind, review)["status"]["allowed"])
