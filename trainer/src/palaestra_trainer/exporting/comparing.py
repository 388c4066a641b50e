"""Compare an exported file with the policy that it came from."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from gymnasium import spaces

from palaestra_trainer.errors import ExportError
from palaestra_trainer.exporting.acting import OBSERVATION, Acting
from palaestra_trainer.run.policies import Policy

OBSERVATIONS = 1_000
EPISODE = 100  # observations after which a recurrent policy begins anew
TOLERANCE = 1e-5  # of a continuous action, relative to its range if that is above 1

Arrays = tuple[np.ndarray, ...]
Run = Callable[..., Arrays]  # inputs of a batch to its outputs


def compare(run: Run, acting: Acting, policy: Policy) -> float:
    """Return the largest difference of an action on 1,000 observations drawn from the spaces.

    Raises:
        ExportError: discrete actions differ, or continuous ones by more than the tolerance.
    """
    observations = drawn(acting, OBSERVATIONS)
    play = _played_at_once if acting.state_shape is None else _played_in_turn
    ours, expected = play(run, acting, policy, observations)
    if ours.shape != expected.shape:
        raise ExportError(f"actions have the shape {ours.shape}, not {expected.shape}; {_REMEDY}")
    apart = np.abs(ours.astype(np.float64) - expected.astype(np.float64))
    continuous = isinstance(acting.action_space, spaces.Box)
    worst = float(np.nan_to_num(apart, nan=np.inf).max())
    if worst > (TOLERANCE if continuous else 0.0):
        raise ExportError(
            f"the exported policy acts differently on {int((apart > 0).sum())} of {apart.size} numbers, "
            f"by up to {worst:.3g}; {_REMEDY}"
        )
    return worst


_REMEDY = "nothing was written; use load_policy where this policy is needed"


def drawn(acting: Acting, count: int) -> dict[str, np.ndarray]:
    """Return observations of each part, drawn from its space, always the same."""
    observations = {}
    for number, (name, space) in enumerate(acting.spaces.items()):
        space.seed(number)
        observations[name] = np.stack([np.asarray(space.sample()) for _ in range(count)])
    return observations


def _played_at_once(
    run: Run, acting: Acting, policy: Policy, observations: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    del acting
    (ours,) = run(*observations.values())
    return ours, np.asarray(policy.predict(_whole(observations))[0])


def _played_in_turn(
    run: Run, acting: Acting, policy: Policy, observations: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Play observation after observation, with the state of the one before."""
    ours, expected = [], []
    state: Arrays = ()
    other: Any = None
    for number in range(OBSERVATIONS):
        begins = number % EPISODE == 0
        if begins:
            state = tuple(zeros.numpy() for zeros in acting.begin(1))
        batch = {name: part[number : number + 1] for name, part in observations.items()}
        action, *rest = run(*batch.values(), *state)
        state = tuple(rest)
        wanted, other = policy.predict(_whole(batch), other, np.array([begins]))
        ours.append(action)
        expected.append(wanted)
    return np.concatenate(ours), np.concatenate(expected)


def _whole(parts: Mapping[str, np.ndarray]) -> Any:
    return parts[OBSERVATION] if list(parts) == [OBSERVATION] else dict(parts)
