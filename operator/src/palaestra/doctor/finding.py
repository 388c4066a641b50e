"""The input and the result of a check."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum

from palaestra.cluster import Api


class Verdict(StrEnum):
    """The result of a check."""

    RIGHT = "ok"
    WARNING = "warning"  # it works, but may cause problems later
    WRONG = "wrong"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One line of the doctor's report.

    Attributes:
        what: the subject of the check.
        verdict: the result.
        fact: the observation, in a sentence.
        remedy: the action to take; empty if the result is right.
    """

    what: str
    verdict: Verdict
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


Check = Callable[[Site], Iterator[Finding]]


def right(what: str, fact: str) -> Finding:
    """Return the finding that a subject is right."""
    return Finding(what=what, verdict=Verdict.RIGHT, fact=fact)


def wrong(what: str, fact: str, remedy: str) -> Finding:
    """Return the finding that a subject is wrong."""
    return Finding(what=what, verdict=Verdict.WRONG, fact=fact, remedy=remedy)


def warning(what: str, fact: str, remedy: str) -> Finding:
    """Return the finding that a subject works but may cause problems later."""
    return Finding(what=what, verdict=Verdict.WARNING, fact=fact, remedy=remedy)


def unknown(what: str, fact: str, remedy: str) -> Finding:
    """Return the finding that a subject could not be checked."""
    return Finding(what=what, verdict=Verdict.UNKNOWN, fact=fact, remedy=remedy)
