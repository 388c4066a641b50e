"""The input of a check, `Site`, and its result, `CheckResult`."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum

from palaestra.cluster import Api


class CheckStatus(StrEnum):
    """The result of a check."""

    RIGHT = "ok"
    WARNING = "warning"  # the checked subject works, but may cause problems later
    WRONG = "wrong"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckResult:
    """One line of the doctor's report.

    Attributes:
        what: the subject of the check.
        verdict: whether the subject is right or wrong, works with a risk, or is unknown.
        fact: the observation, in a sentence.
        remedy: the action to take; empty if the verdict is RIGHT.
    """

    what: str
    verdict: CheckStatus
    fact: str
    remedy: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """The cluster and namespaces to check.

    Attributes:
        api: the cluster, with the user's credentials.
        namespace: namespace of the user's jobs.
        operator_namespace: namespace of the operator.
    """

    api: Api
    namespace: str
    operator_namespace: str


Check = Callable[[Site], Iterator[CheckResult]]


def right(what: str, fact: str) -> CheckResult:
    """Return the result for a subject without problems."""
    return CheckResult(what=what, verdict=CheckStatus.RIGHT, fact=fact)


def wrong(what: str, fact: str, remedy: str) -> CheckResult:
    """Return the result for a subject with a problem."""
    return CheckResult(what=what, verdict=CheckStatus.WRONG, fact=fact, remedy=remedy)


def warning(what: str, fact: str, remedy: str) -> CheckResult:
    """Return the result for a subject that works but may cause problems later."""
    return CheckResult(what=what, verdict=CheckStatus.WARNING, fact=fact, remedy=remedy)


def unknown(what: str, fact: str, remedy: str) -> CheckResult:
    """Return the result for a subject that could not be checked."""
    return CheckResult(what=what, verdict=CheckStatus.UNKNOWN, fact=fact, remedy=remedy)
