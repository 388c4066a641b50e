"""Headers for impersonation, from `as` and the related fields of a kubeconfig's user.

Source of the names and the escape rules: NewImpersonatingRoundTripper in k8s.io/client-go/transport.
"""

import string
from collections.abc import Mapping
from typing import Any

from palaestra.cluster.client_config import Headers
from palaestra.cluster.errors import NotConfigured

USER, UID, GROUPS, EXTRA = "as", "as-uid", "as-groups", "as-user-extra"
# The characters of an HTTP token (RFC 7230) except %.
_LEGAL = frozenset((string.ascii_letters + string.digits + "!#$&'*+-.^_`|~").encode())


def impersonation(user: Mapping[str, Any]) -> Headers:
    """Return the impersonation headers of a kubeconfig's user; empty without impersonation.

    Raises:
        NotConfigured: a value has a wrong type, or `as` does not name a user.
    """
    groups, extra = user.get(GROUPS) or [], user.get(EXTRA) or {}
    if not isinstance(groups, list):
        raise NotConfigured(f"{GROUPS}: {groups!r} is not a list; write a list of groups")
    if not isinstance(extra, Mapping) or not all(isinstance(values, list) for values in extra.values()):
        raise NotConfigured(
            f"{EXTRA}: {extra!r} is not a mapping of lists; write a list of texts under each key"
        )
    name, uid = user.get(USER) or "", user.get(UID) or ""
    if not name:
        if groups or extra or uid:
            raise NotConfigured(
                f"{USER} is missing, but required with {GROUPS}, {UID} or {EXTRA}; set it to the user's name"
            )
        return ()
    found = [("Impersonate-User", _text(name, USER))]
    found += [("Impersonate-Uid", _text(uid, UID))] if uid else []
    found += [("Impersonate-Group", _text(group, GROUPS)) for group in groups]
    for key, values in extra.items():
        header = f"Impersonate-Extra-{_escaped(_text(key, EXTRA))}"
        found += [(header, _text(value, EXTRA)) for value in values]
    return tuple(found)


def _text(value: object, field: str) -> str:
    if not isinstance(value, str) or not value.isprintable():
        raise NotConfigured(
            f"{field}: {value!r} is not text of printable characters; "
            "write it as text, in quotes, on one line"
        )
    return value


def _escaped(key: str) -> str:
    return "".join(chr(byte) if byte in _LEGAL else f"%{byte:02X}" for byte in key.encode())
