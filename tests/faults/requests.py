"""Parse a request of an operator, so that plans and reports can name it. Pure."""

from collections.abc import Mapping
from dataclasses import dataclass
from urllib.parse import parse_qs, urlsplit

WRITE, EVENT, GET, LIST, WATCH, CHANGE, LEASE = "write", "event", "get", "list", "watch", "change", "lease"
ANSWER = "answer"  # a trainer sends this response; all others come from the API server
METHODS = {"GET": "get", "POST": "create", "PUT": "update", "PATCH": "patch", "DELETE": "delete"}
APPLY = "application/apply-patch"
GROUP_PARTS = {"api": 2, "apis": 3}  # /api/v1, /apis/batch/v1


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """One request, in the words of RBAC.

    Attributes:
        verb: `get`, `list`, `watch`, `create`, `apply`, `patch` or `delete`.
        resource: the plural, with a subresource after a slash: `trainingjobs/status`.
        name: the name of the object, or "" if the request names none.
    """

    verb: str
    resource: str
    name: str = ""

    @property
    def kind(self) -> str:
        """The kind by which plans count the request: write, event, get, list, watch, or lease."""
        plural = self.resource.partition("/")[0]
        if plural == "leases":
            return LEASE
        if self.verb in {GET, LIST, WATCH, ANSWER}:
            return self.verb
        return EVENT if plural == "events" else WRITE

    @property
    def words(self) -> str:
        """The request as text: `patch trainingjobs/status job`."""
        return f"{self.verb} {self.resource} {self.name}".rstrip()


def asked(method: str, target: str, headers: Mapping[str, str]) -> Asked:
    """Return a request's verb and object, from its method, its path with query, and its headers."""
    address = urlsplit(target)
    parts = address.path.strip("/").split("/")
    resource, name = _object(parts[GROUP_PARTS.get(parts[0], len(parts)) :])
    verb = METHODS.get(method, method.lower())
    if method == "PATCH" and headers.get("Content-Type", "").startswith(APPLY):
        verb = "apply"
    if verb == GET and resource and not name:
        verb = WATCH if "watch" in parse_qs(address.query) else LIST
    return Asked(verb=verb, resource=resource or address.path, name=name)


def _object(parts: list[str]) -> tuple[str, str]:
    """Return resource and name from the path after group and version."""
    if len(parts) > 2 and parts[0] == "namespaces":  # two parts name a Namespace itself
        parts = parts[2:]
    plural, name, *below = [*parts, "", ""][: max(len(parts), 2)]
    return (f"{plural}/{below[0]}" if below else plural), name
