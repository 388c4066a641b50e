"""A hold: the cause that keeps a job from being planned, with its reason and message."""

from dataclasses import dataclass

from palaestra.api.reasons import Reason, say
from palaestra.decide.conditions import Explanation


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """A cause that keeps a job from being planned; if it is `final`, nothing can remove it."""

    explanation: Explanation
    final: bool = False


def held(reason: Reason, *, final: bool = False, **facts: object) -> Hold:
    """Return the hold for a reason, with the facts of its message."""
    return Hold(explanation=Explanation(reason=reason, message=say(reason, **facts)), final=final)
