"""A reason with its message, and a hold: the cause that keeps a job from being planned."""

from dataclasses import dataclass

from palaestra.api.reason_texts import say
from palaestra.api.reasons import Reason


@dataclass(frozen=True, slots=True, kw_only=True)
class Explanation:
    """A reason and its message."""

    reason: Reason
    message: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """A cause that keeps a job from being planned; `final`: nobody can remove the cause."""

    explanation: Explanation
    final: bool = False


def explain(reason: Reason, **facts: object) -> Explanation:
    """Return a reason with its message."""
    return Explanation(reason=reason, message=say(reason, **facts))


def held(reason: Reason, *, final: bool = False, **facts: object) -> Hold:
    """Return the hold for a reason, with the facts of its message."""
    return Hold(explanation=explain(reason, **facts), final=final)
