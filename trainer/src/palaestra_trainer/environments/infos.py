"""The info of a step, and the keys in it that Palaestra sets.

Stable-Baselines3 reads `episode`, `terminal_observation` and `TimeLimit.truncated`. Palaestra puts its other
facts about a step into a dict of its own, `info["palaestra"]`, so that no key of an environment is taken for
one of Palaestra:

- `valid`: False in a row that must not be learned from
- `sim_fault`: in the row that a fault truncated: kind, simulator, fact, episode and step
- `recovering`: in the rows after it, until the simulator is up again; False once it was given up
- `extra_steps`: simulation steps that a late message made necessary
- `hidden`: values of the environment under keys that Stable-Baselines3 or Palaestra uses
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
    """Return Palaestra's part of the info of a step; empty if it has none."""
    found = info.get(OURS)
    return found if isinstance(found, Mapping) else {}


def is_valid(info: Mapping[str, Any]) -> bool:
    """Return whether a row may be learned from."""
    return bool(ours(info).get("valid", True))


def extra_steps(info: Mapping[str, Any]) -> int:
    """Return the extra simulation steps of a step; 0 if a user's environment sets an invalid value."""
    steps = ours(info).get("extra_steps", 0)
    return steps if isinstance(steps, int) and steps > 0 else 0


def of_environment(info: Mapping[str, Any], **words: Any) -> dict[str, Any]:
    """Return an environment's info with our `words`; its keys that we or others use are moved to `hidden`."""
    taken = {name: info[name] for name in OF_STABLE_BASELINES3 if name in info}
    if OURS in info and ours(info).keys() != {"extra_steps"}:
        taken[OURS] = info[OURS]
    said = {"extra_steps": steps} if (steps := extra_steps(info)) else {}
    kept = {name: value for name, value in info.items() if name not in taken}
    return kept | {OURS: said | ({HIDDEN: taken} if taken else {}) | words}
