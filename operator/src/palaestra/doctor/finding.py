"""What a check comes to, and what it is given."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from enum import StrEnum

from palaestra.cluster import Api


class Verdict(StrEnum):
    """How something is."""

    RIGHT = "ok"
    WARNING = "warning"  # it works; something about it may surprise later
    WRONG = "wrong"
    UNKNOWN = "unknown"


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One line of what the doctor tells.

    Attributes:
        what: was looked at.
        verdict: how it is.
        fact: what was seen, in a sentence.
        remedy: what to do about it; empty where it is right.
    """

    what: str
    verdict: Verdict
    fact: str
    remedy: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Site:
    """What is looked at.

    Attributes:
        api: the cluster, as the person who asks.
        namespace: where that person has jobs.
        operator_namespace: where the operator is installed.
    """

    api: Api
    namespace: str
    operator_namespace: str


Check = Callable[[Site], Iterator[Finding]]


def right(what: str, fact: str) -> Finding:
    """Return that something is as it must be."""
    return Finding(what=what, verdict=Verdict.RIGHT, fact=fact)


def wrong(what: str, fact: str, remedy: str) -> Finding:
    """Return that something is not as it must be."""
    return Finding(what=what, verdict=Verdict.WRONG, fact=fact, remedy=remedy)


def warning(what: str, fact: str, remedy: str) -> Finding:
    """Return that something works, and that it could be better."""
    return Finding(what=what, verdict=Verdict.WARNING, fact=fact, remedy=remedy)


def unknown(what: str, fact: str, remedy: str) -> Finding:
    """Return that something could not be seen."""
    return Finding(what=what, verdict=Verdict.UNKNOWN, fact=fact, remedy=remedy)
