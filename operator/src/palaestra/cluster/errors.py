"""What an API server can answer instead of what was asked for.

ApiError                    any answer but success; `retryable` says whether it may succeed later
├── NotFound                404
│   └── NoSuchKind          404 without a word about an object: the kind itself is not served
├── AlreadyExists           409, the name is taken
├── Conflict                409, somebody else wrote first: read again
├── Forbidden               403, RBAC, quota or admission says no
│   └── NamespaceTerminating 403, nothing can be created in a namespace that is being deleted
├── Invalid                 400 and 422, the object is wrong: never retried
├── Gone                    410, the version to continue from is forgotten: list again
├── TooManyRequests         429, with the wait that the server asks for
├── ServerError             5xx, the API server or its store is in trouble
└── Unreachable             no answer, or none that can be read
NotConfigured               no API server is named, or its credentials cannot be read
CommandFailed               a command in a container ended with another code than 0

A message is the API server's own: it names the object and, for an invalid one, the field.
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


class NotConfigured(PalaestraError, ValueError):
    """No API server is named, or its credentials cannot be read; retrying cannot help."""


class ApiError(PalaestraError, OSError):
    """An answer other than success.

    Attributes:
        code: the HTTP status; 0 when there was no answer.
        reason: the API server's word for it, such as `AlreadyExists`; a test for equality is safe.
        message: the API server's sentence.
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
    """The API server does not serve this kind of objects, as before its definition is installed."""


class AlreadyExists(ApiError):
    """The name is taken; whose it is, its owner reference says."""


class Conflict(ApiError):
    """The object was changed by somebody else, or has another uid, since it was read."""

    retryable = True


class Forbidden(ApiError):
    """RBAC, a quota, Pod Security or a webhook refuses; a person has to act."""

    @property
    def lacks_right(self) -> bool:
        """Whether it is RBAC that refuses, as its words say: no field of the answer does."""
        return re.search(r" cannot \S+ resource ", self.message) is not None


class NamespaceTerminating(Forbidden):
    """The namespace is being deleted, so that nothing can be created in it any more; it never comes back."""


class Invalid(ApiError):
    """The object is wrong; the message names the field."""


class Gone(ApiError):
    """The version or the page to continue from is forgotten: list again."""

    retryable = True


class TooManyRequests(ApiError):
    """The API server is busy.

    Attributes:
        retry_after_s: seconds that it asks to wait.
    """

    retryable = True

    def __init__(self, code: int, reason: str, message: str) -> None:
        super().__init__(code, reason, message)
        self.retry_after_s = DEFAULT_RETRY_AFTER_S


class ServerError(ApiError):
    """The API server or its store is in trouble (5xx)."""

    retryable = True


class Unreachable(ApiError):
    """No answer in time, or none that can be read; whether a write took place is not known."""

    retryable = True


class CommandFailed(PalaestraError):
    """A command in a container failed.

    Attributes:
        code: its exit code; -1: not known.
        said: the beginning of what it wrote to standard error.
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
    if code == NOT_FOUND and not status:  # what an API server does not serve, it refuses in plain text
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
    """Return the error that a cause names where the reason is that of many."""
    causes = (status.get("details") or {}).get("causes") or ()
    return next((BY_CAUSE[each["reason"]] for each in causes if each.get("reason") in BY_CAUSE), None)


def _seconds(text: str | None) -> float:
    try:
        seconds = float(text) if text is not None else DEFAULT_RETRY_AFTER_S
    except ValueError:  # a date: allowed by HTTP, never sent by Kubernetes
        return DEFAULT_RETRY_AFTER_S
    return max(seconds, 0.0) if math.isfinite(seconds) else DEFAULT_RETRY_AFTER_S
