"""The errors for an API server's refusals, and for its absence.

ApiError                    any answer but success; `retryable` says whether it may succeed later
├── NotFound                404
│   └── NoSuchKind          404 that names no object: the kind itself is not served
├── AlreadyExists           409, the name is taken
├── Conflict                409, somebody else wrote first: read again
├── Forbidden               403, RBAC, a quota or admission refuses
│   └── NamespaceTerminating 403, nothing can be created in a namespace that is being deleted
├── Invalid                 400 and 422, the object is wrong: never retried
├── Gone                    410, the version to continue from has expired: list again
├── TooManyRequests         429, with the wait that the server asks for
├── ServerError             5xx, the API server or its store is in trouble
└── Unreachable             no answer, or none that can be read
    └── Untrusted           the server's certificate is refused: nothing was sent
NotConfigured               no API server is named, or its credentials cannot be read
CommandFailed               the exit code of a command in a container is not 0

A message is the API server's own: it names the object and, if the object is invalid, the field.
"""

import math
import re
from collections.abc import Mapping
from typing import Any, ClassVar

from palaestra.errors import PalaestraError

NOT_FOUND = 404
CONFLICT = 409
GONE = 410
TOO_MANY_REQUESTS = 429
SERVER_ERROR = 500
DEFAULT_RETRY_AFTER_S = 1.0
CONFIGURE = "name a kubeconfig with --kubeconfig or KUBECONFIG, or run in a pod with a service account"


class NotConfigured(PalaestraError, ValueError):
    """No API server is named, or its credentials cannot be read; retrying cannot help."""


class ApiError(PalaestraError, OSError):
    """An answer other than success.

    Attributes:
        code: the HTTP status; 0 without an answer.
        reason: the API server's reason, such as `AlreadyExists`; compare it for equality.
        message: the API server's message.
    """

    retryable: ClassVar[bool] = False

    def __init__(self, code: int, reason: str, message: str) -> None:
        super().__init__(message)
        self.code = code
        self.reason = reason
        self.message = message

    def __str__(self) -> str:
        return f"{self.reason} ({self.code}): {self.message}" if self.code else self.message


class NotFound(ApiError):
    """There is no such object, or no such kind of objects."""


class NoSuchKind(NotFound):
    """The API server does not serve this kind of objects; its definition may not be installed yet."""


class AlreadyExists(ApiError):
    """An object of this name exists; its owner reference names its owner."""


class Conflict(ApiError):
    """Another client changed the object since it was read, or it has another uid."""

    retryable = True


class Forbidden(ApiError):
    """RBAC, a quota, Pod Security or a webhook refuses; a person has to act."""

    @property
    def lacks_right(self) -> bool:
        """Return whether RBAC refuses, by its message; no field of the answer says so."""
        return re.search(r" cannot \S+ resource ", self.message) is not None


class NamespaceTerminating(Forbidden):
    """The namespace is being deleted, so nothing can be created in it any more."""


class Invalid(ApiError):
    """The object is wrong; the message names the field."""


class Gone(ApiError):
    """The version or the page to continue from has expired: list again."""

    retryable = True


class TooManyRequests(ApiError):
    """The API server is busy.

    Attributes:
        retry_after_s: seconds that it asks us to wait.
    """

    retryable = True

    def __init__(self, code: int, reason: str, message: str) -> None:
        super().__init__(code, reason, message)
        self.retry_after_s = DEFAULT_RETRY_AFTER_S


class ServerError(ApiError):
    """The API server or its store is in trouble (5xx)."""

    retryable = True


class Unreachable(ApiError):
    """No answer in time, or an unreadable one; whether a write took place is unknown."""

    retryable = True


class Untrusted(Unreachable):
    """The server's certificate is refused, so nothing was sent.

    Attributes:
        fact: which server, and what is wrong with its certificate.
        remedy: what a person does about it.
    """

    def __init__(self, fact: str, remedy: str) -> None:
        super().__init__(0, "Untrusted", f"{fact}; {remedy}")
        self.fact = fact
        self.remedy = remedy


class CommandFailed(PalaestraError):
    """A command in a container failed.

    Attributes:
        code: its exit code; -1: unknown.
        said: the first bytes of its standard error, as text.
    """

    def __init__(self, code: int, said: str) -> None:
        super().__init__(f"exit code {code}: {said or 'it said nothing'}")
        self.code = code
        self.said = said


BY_REASON: dict[str, type[ApiError]] = {"AlreadyExists": AlreadyExists, "Expired": Gone, "Gone": Gone}
BY_CODE: dict[int, type[ApiError]] = {
    400: Invalid,
    403: Forbidden,
    NOT_FOUND: NotFound,
    CONFLICT: Conflict,
    GONE: Gone,
    422: Invalid,
    TOO_MANY_REQUESTS: TooManyRequests,
}


BY_CAUSE: dict[str, type[ApiError]] = {"NamespaceTerminating": NamespaceTerminating}


def from_status(code: int, status: Mapping[str, Any], retry_after: str | None = None) -> ApiError:
    """Return the error for an HTTP status and the `Status` object that came with it.

    Args:
        code: the HTTP status, or the code in the Status of an ERROR event.
        status: the body; anything may be missing in it.
        retry_after: the Retry-After header, in seconds.
    """
    if code == NOT_FOUND and not status:  # for a path that it does not serve, the answer is plain text
        return NoSuchKind(code, "NoSuchKind", "the API server does not serve this kind of objects")
    reason = str(status.get("reason") or f"HTTP{code}")
    message = str(status.get("message") or "the API server gave no message")
    fallback = ServerError if code >= SERVER_ERROR else ApiError
    kind = _by_cause(status) or BY_REASON.get(reason, BY_CODE.get(code, fallback))
    error = kind(code, reason, message)
    if isinstance(error, TooManyRequests):
        error.retry_after_s = _seconds(retry_after)
    return error


def _by_cause(status: Mapping[str, Any]) -> type[ApiError] | None:
    """Return the error that a cause names, for reasons that several errors share."""
    causes = (status.get("details") or {}).get("causes") or ()
    return next((BY_CAUSE[cause["reason"]] for cause in causes if cause.get("reason") in BY_CAUSE), None)


def _seconds(text: str | None) -> float:
    try:
        seconds = float(text) if text is not None else DEFAULT_RETRY_AFTER_S
    except ValueError:  # a date: allowed by HTTP, never sent by Kubernetes
        return DEFAULT_RETRY_AFTER_S
    return max(seconds, 0.0) if math.isfinite(seconds) else DEFAULT_RETRY_AFTER_S
