"""The exceptions for an API server that refuses a request or does not respond.

ApiError                    any response but success; `retryable`: whether a retry may succeed
├── NotFound                404
│   └── NoSuchKind          404 without an object: the kind itself is not served
├── AlreadyExists           409, the name is taken
├── Conflict                409, another client wrote first: read again
├── Forbidden               403, RBAC, a quota or admission refuses
│   └── NamespaceTerminating 403, the namespace is being deleted, so creations are refused
├── Invalid                 400 and 422, the object is wrong: never retried
├── Gone                    410, the version to continue from has expired: list again
├── TooManyRequests         429, with the wait that the server asks for
├── ServerError             5xx, the API server or its store has failed
└── Unreachable             no response, or an unreadable one
    └── Untrusted           the server's certificate is not trusted: the request was not sent
NotConfigured               no API server is configured, or its credentials cannot be read
CommandFailed               the exit code of a command in a container is not 0

The message of an ApiError is the API server's own message. The message names the object and, if the object is
invalid, the field.
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
    """No API server is configured, or its credentials cannot be read; retrying cannot help."""


class ApiError(PalaestraError, OSError):
    """A response other than success, or no response.

    Attributes:
        code: the HTTP status; 0 without a response.
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
    """The object or its kind does not exist."""


class NoSuchKind(NotFound):
    """The API server does not serve this kind of objects; its definition may not be installed yet."""


class AlreadyExists(ApiError):
    """An object of this name exists; its owner reference shows whether it is the expected object."""


class Conflict(ApiError):
    """Another client changed the object since it was read, or replaced it by an object with another uid."""

    retryable = True


class Forbidden(ApiError):
    """RBAC, a quota, Pod Security or a webhook refuses the request; a person must act."""

    @property
    def lacks_right(self) -> bool:
        """Return whether RBAC refuses the request; only the text of the message shows this."""
        return re.search(r" cannot \S+ resource ", self.message) is not None


class NamespaceTerminating(Forbidden):
    """The namespace is being deleted, so no object can be created in it."""


class Invalid(ApiError):
    """The object is invalid; the message names the field."""


class Gone(ApiError):
    """The version or the list page from which to continue has expired: list again."""

    retryable = True


class TooManyRequests(ApiError):
    """The API server is busy.

    Attributes:
        retry_after_s: seconds that the API server asks the client to wait before a retry.
    """

    retryable = True

    def __init__(self, code: int, reason: str, message: str) -> None:
        super().__init__(code, reason, message)
        self.retry_after_s = DEFAULT_RETRY_AFTER_S


class ServerError(ApiError):
    """The API server or its store has failed (5xx)."""

    retryable = True


class Unreachable(ApiError):
    """No readable response came in time, so a write may or may not have happened."""

    retryable = True


class Untrusted(Unreachable):
    """The server's certificate is not trusted, so the request was not sent.

    Attributes:
        fact: the server, and the problem with its certificate.
        remedy: the action for a person.
    """

    def __init__(self, fact: str, remedy: str) -> None:
        super().__init__(0, "Untrusted", f"{fact}; {remedy}")
        self.fact = fact
        self.remedy = remedy


class CommandFailed(PalaestraError):
    """A command in a container failed.

    Attributes:
        code: the exit code of the command; -1: unknown.
        said: the first bytes of the command's standard error, as text.
    """

    def __init__(self, code: int, said: str) -> None:
        super().__init__(f"exit code {code}: {said or 'no output'}")
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
    """Return the exception for an HTTP status and the `Status` object in the response.

    Args:
        code: the HTTP status, or the code in the Status of an ERROR event.
        status: the `Status` object; each field may be missing.
        retry_after: the Retry-After header, in seconds.
    """
    # If a path is not served, the response is plain text instead of a Status.
    if code == NOT_FOUND and not status:
        return NoSuchKind(code, "NoSuchKind", "the API server does not serve this kind of objects")
    reason = str(status.get("reason") or f"HTTP{code}")
    # If the API server forwards a request to one of Palaestra's own servers, `error` has the message.
    message = str(status.get("message") or status.get("error") or "the API server gave no message")
    fallback = ServerError if code >= SERVER_ERROR else ApiError
    kind = _by_cause(status) or BY_REASON.get(reason, BY_CODE.get(code, fallback))
    error = kind(code, reason, message)
    if isinstance(error, TooManyRequests):
        error.retry_after_s = _seconds(retry_after)
    return error


def _by_cause(status: Mapping[str, Any]) -> type[ApiError] | None:
    """Return the exception for the cause in a Status, or None; one reason may have several exceptions."""
    causes = (status.get("details") or {}).get("causes") or ()
    return next((BY_CAUSE[cause["reason"]] for cause in causes if cause.get("reason") in BY_CAUSE), None)


def _seconds(text: str | None) -> float:
    try:
        seconds = float(text) if text is not None else DEFAULT_RETRY_AFTER_S
    except ValueError:  # the header is a date, which HTTP allows but Kubernetes never sends
        return DEFAULT_RETRY_AFTER_S
    return max(seconds, 0.0) if math.isfinite(seconds) else DEFAULT_RETRY_AFTER_S
