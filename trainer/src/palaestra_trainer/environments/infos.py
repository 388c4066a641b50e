"""The keys that Palaestra sets in the info of a step.

Stable-Baselines3 reads the keys `episode`, `terminal_observation` and `TimeLimit.truncated`. Palaestra puts
its other facts about a step into a separate dict, `info["palaestra"]`. So the keys of an environment and
those of Palaestra cannot be confused:

- `valid`: False in a row that the algorithm must not learn from
- `sim_fault`: the kind, simulator, fact, episode and step of a fault; only in the row of that fault
- `recovering`: True in the rows after the fault until the simulator is up again; False in the rows of a
  simulator without which the run continues
- `pending`: True in the invalid rows of a simulator whose step has not ended yet, in asynchronous collection
- `extra_steps`: simulation steps in addition to the usual one, because a message was late
- `hidden`: the environment's own values for keys that Stable-Baselines3 or Palaestra uses
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
    """Return Palaestra's dict in the info of a step, or an empty dict if the info does not have one."""
    found = info.get(OURS)
    return found if type(found) is dict or isinstance(found, Mapping) else {}


def is_valid(info: Mapping[str, Any]) -> bool:
    """Return whether an algorithm may learn from a row."""
    return bool(ours(info).get("valid", True))


def is_pending(info: Mapping[str, Any]) -> bool:
    """Return whether the step of a row has not ended yet; such a row is only a placeholder."""
    return ours(info).get("pending") is True


def extra_steps(info: Mapping[str, Any]) -> int:
    """Return the extra simulation steps of an environment step; 0 if its info holds an invalid value."""
    steps = ours(info).get("extra_steps", 0)
    return steps if isinstance(steps, int) and steps > 0 else 0


def of_environment(info: Mapping[str, Any], **words: Any) -> dict[str, Any]:
    """Return an environment's info with Palaestra's `words`; move the values of reserved keys to `hidden`."""
    taken = {name: info[name] for name in OF_STABLE_BASELINES3 if name in info}
    if OURS in info and ours(info).keys() != {"extra_steps"}:
        taken[OURS] = info[OURS]
    said: dict[str, Any] = {"extra_steps": steps} if (steps := extra_steps(info)) else {}
    kept = dict(info)
    if taken:
        kept = {name: value for name, value in info.items() if name not in taken}
        said[HIDDEN] = taken
    kept[OURS] = said | words
    return kept
