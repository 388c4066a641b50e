"""The info of a step, and which words in it are ours.

Stable-Baselines3 reads `episode`, `terminal_observation` and `TimeLimit.truncated`. All else that Palaestra
says of a step is in a dict of its own, `info["palaestra"]`, so that no word of an environment is taken for
ours:

- `valid`: False in a row that nothing may be learned from
- `sim_fault`: of the row that a fault cut: kind, simulator, fact, episode and step
- `recovering`: in the rows after it, until the simulator is up again; False once it was given up
- `extra_steps`: simulation steps that a late message made necessary
- `hidden`: words of the environment that have a meaning of their own in Stable-Baselines3
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import structlog

log = structlog.get_logger(__name__)

OURS = "palaestra"
HIDDEN = "hidden"
TRUNCATED = "TimeLimit.truncated"
OF_STABLE_BASELINES3 = ("episode", "terminal_observation")


def ours(info: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return what Palaestra says of a step; empty where it says nothing."""
    found = info.get(OURS)
    return found if isinstance(found, Mapping) else {}


def is_valid(info: Mapping[str, Any]) -> bool:
    """Return whether a row may be learned from."""
    return bool(ours(info).get("valid", True))


def extra_steps(info: Mapping[str, Any]) -> int:
    """Return the extra simulation steps of a step; an environment of a user's may say nonsense."""
    steps = ours(info).get("extra_steps", 0)
    return steps if isinstance(steps, int) and steps > 0 else 0


def of_environment(info: Mapping[str, Any], **words: Any) -> dict[str, Any]:
    """Return an environment's info with our `words`; those that only Stable-Baselines3 may say are moved."""
    taken = {name: info[name] for name in OF_STABLE_BASELINES3 if name in info}
    if OURS in info and ours(info).keys() != {"extra_steps"}:
        taken[OURS] = info[OURS]
    said = {"extra_steps": steps} if (steps := extra_steps(info)) else {}
    kept = {name: value for name, value in info.items() if name not in taken}
    return kept | {OURS: said | ({HIDDEN: taken} if taken else {}) | words}
