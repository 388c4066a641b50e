"""Permissions of service accounts: those that roles grant, and those that an audit log contains. Pure."""

import json
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from typing import Any, NamedTuple

Object = Mapping[str, Any]

CREATED = 201
ACCOUNT = "system:serviceaccount:"


class Right(NamedTuple):
    """A verb on a kind of objects, or on a subresource such as `trainingjobs/status`."""

    group: str
    resource: str
    verb: str


class Use(NamedTuple):
    """A request of a service account, and whether it was allowed; `reason` names the binding."""

    namespace: str
    account: str
    right: Right
    allowed: bool
    reason: str


def granted(objects: Iterable[Object], namespace: str, account: str) -> set[Right]:
    """Return all permissions that the bindings among `objects` grant to a service account."""
    found = list(objects)
    roles = {_key(each["kind"], each, each["metadata"]["name"]): each for each in found if "rules" in each}
    subject = {"kind": "ServiceAccount", "name": account, "namespace": namespace}
    bound = [
        roles[_key(each["roleRef"]["kind"], each, each["roleRef"]["name"])]
        for each in found
        if subject in each.get("subjects", ())
    ]
    return {right for role in bound for right in held(role)}


def held(role: Object) -> set[Right]:
    """Return all permissions that a role grants."""
    return {
        Right(group, resource, verb)
        for rule in role["rules"]
        for group in rule["apiGroups"]
        for resource in rule["resources"]
        for verb in rule["verbs"]
    }


def uses(log: str, since: str = "") -> Iterator[Use]:
    """Yield the requests of service accounts since a time (ISO 8601, UTC), without discovery requests."""
    for line in log.splitlines():
        with suppress(json.JSONDecodeError):  # the last line may be incomplete
            entry = json.loads(line)
            if entry["requestReceivedTimestamp"] >= since and "objectRef" in entry:
                yield from _uses(entry)


def _uses(entry: Object) -> Iterator[Use]:
    if not entry["user"]["username"].startswith(ACCOUNT):
        return
    namespace, _, account = entry["user"]["username"].removeprefix(ACCOUNT).partition(":")
    notes, target = entry.get("annotations", {}), entry["objectRef"]
    allowed = notes.get("authorization.k8s.io/decision") == "allow"
    resource = "/".join(filter(None, (target["resource"], target.get("subresource"))))
    verbs = [entry["verb"]]
    if entry["verb"] == "patch" and entry.get("responseStatus", {}).get("code") == CREATED:
        verbs.append("create")  # to apply a new object, a client needs both verbs
    for verb in verbs:
        right = Right(target.get("apiGroup", ""), resource, verb)
        yield Use(namespace, account, right, allowed, notes.get("authorization.k8s.io/reason", ""))


def _key(kind: str, beside: Object, name: str) -> tuple[str, str | None, str]:
    """Return the key of a role; a Role has the namespace of its binding."""
    return kind, beside["metadata"].get("namespace") if kind == "Role" else None, name
