"""Rights, checked with access reviews of the API server instead of by reading roles.

The table of the operator's rights is compared with the installed role by a test.
"""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from palaestra.cluster.resources import OWN_RIGHTS, RIGHTS
from palaestra.doctor.finding import Finding, Site, right, unknown, wrong
from palaestra.objects import Object


@dataclass(frozen=True, slots=True, kw_only=True)
class Right:
    """What may be done with one kind of objects; `resource` is `pods`, or `pods/log`."""

    group: str
    resource: str
    verbs: tuple[str, ...]

    def asked(self, namespace: str) -> Iterator[tuple[str, Object]]:
        """Yield, for each verb, how a person says it and how the API server is asked."""
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
        """Return it as the API server sees it when it asks."""
        groups = ["system:serviceaccounts", f"system:serviceaccounts:{self.namespace}"]
        return {"user": f"system:serviceaccount:{self.namespace}:{self.name}", "groups": groups}


def may(group: str, resource: str, verbs: str) -> Right:
    """Return a right from words."""
    return Right(group=group, resource=resource, verbs=tuple(verbs.split()))


OPERATOR = (
    may("palaestra.dev", "trainingjobs", "get list watch delete"),
    may("palaestra.dev", "trainingjobs/status", "patch"),
    may("palaestra.dev", "trainingjobs/finalizers", "update"),
    may("batch", "jobs", "get list watch create patch delete"),
    may("", "pods", "list watch"),
    may("", "pods/eviction", "create"),
    may("", "configmaps", "get list watch create"),
    may("", "persistentvolumeclaims", "get list watch create"),
    may("networking.k8s.io", "networkpolicies", "list watch create patch"),
    may("", "events", "get list create patch"),
)
# For the words of a status alone: without it the operator works, as with a role of an earlier release.
OPERATOR_WITH_KUEUE = (may("kueue.x-k8s.io", "workloads", "list"),)

PERSON: tuple[tuple[str, tuple[Right, ...]], ...] = (
    ("look at jobs", (may("palaestra.dev", "trainingjobs", "get list watch"), may("", "events", "list"))),
    ("author jobs", (may("palaestra.dev", "trainingjobs", "create patch delete"),)),
    ("read logs", (may("", "pods/log", "get"),)),
    (
        "fetch runs",
        (
            may("batch", "jobs", "get"),
            may("", "pods", "get list watch create delete"),
            may("", "pods/exec", "create get"),
        ),
    ),
)
NECESSARY = frozenset({"look at jobs", "author jobs"})  # the rest is for some people only


def own_rights(site: Site) -> Iterator[Finding]:
    """Report what the person who asks may not do, one line for each thing that people do."""
    for deed, rights in PERSON:
        denied = missing(site, rights)
        what = f"to {deed}"
        if denied:
            report = wrong if deed in NECESSARY else unknown
            yield report(
                what,
                f"you may not {', '.join(denied)} in {site.namespace}",
                "ask for a role that has it; without it the rest works",
            )
        else:
            yield right(what, f"you have the rights in {site.namespace}")


def missing(site: Site, rights: Iterable[Right], *, account: Account | None = None) -> list[str]:
    """Return which rights the person who asks, or an account, lacks in the namespace: `list pods`."""
    return [
        said
        for needed in rights
        for said, attributes in needed.asked(site.namespace)
        if not allowed(site, attributes, account=account)
    ]


def allowed(site: Site, attributes: Object, *, account: Account | None = None) -> bool:
    """Return whether the person who asks may do something, or whether an account may."""
    kind, subject = (OWN_RIGHTS, {}) if account is None else (RIGHTS, account.subject)
    review = {
        "apiVersion": kind.api_version,
        "kind": kind.kind,
        "metadata": {},
        "spec": {**subject, "resourceAttributes": attributes},
    }
    return bool(site.api.create(kind, review)["status"]["allowed"])
