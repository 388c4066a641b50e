"""Compare an exported file with its policy."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import torch
from gymnasium import spaces

from palaestra_trainer.environments.data_sheet import OBSERVATION
from palaestra_trainer.errors import ExportError
from palaestra_trainer.exporting.policy_module import PolicyModule, Scoring
from palaestra_trainer.exporting.sample_observations import EPISODE, drawn, drawn_masks, magnitudes
from palaestra_trainer.run.policies import TrainedPolicy

OBSERVATIONS = 1_000
TOLERANCE = 1e-5  # largest allowed difference of a continuous action, as a share of its range
# A comparison is meaningful only if at least this number of actions are between the bounds, or if scores
# differ by this multiple of the tolerance.
_TELLING = 10

Arrays = tuple[np.ndarray, ...]
Run = Callable[..., Arrays]  # a function from the inputs of a batch to its outputs
Convert = Callable[[PolicyModule], Run]


def compare(convert: Convert, acting: PolicyModule, policy: TrainedPolicy) -> float:
    """Return the largest difference between the actions of file and policy, as a share of the range.

    The comparison uses 1,000 observations. A policy that takes masks is compared twice: with random masks,
    and with masks that allow all actions.

    Args:
        convert: a function that converts a module to a file, and returns a function that runs this file.
        acting: the module from which the file will be written.
        policy: the policy that the file must reproduce.

    Raises:
        ExportError: discrete actions differ, or continuous actions differ by more than the tolerance. The
            error is also raised if the comparison proves nothing, because a wrong file could have the same
            actions on these observations.
    """
    observations = drawn(acting, OBSERVATIONS)
    run = convert(acting)
    played = [_played(run, acting, policy, observations, masks) for masks in _masks(acting)]
    difference = max(_difference(*actions, acting, observations) for actions in played)
    # Random masks make even the actions of a constant policy differ, so the check uses the masks that allow
    # all actions.
    _, expected = played[-1]
    _refuse_what_shows_nothing(convert, acting, policy, observations, expected)
    return difference


def _played(
    run: Run,
    acting: PolicyModule,
    policy: TrainedPolicy,
    observations: Mapping[str, np.ndarray],
    masks: Arrays,
) -> tuple[np.ndarray, np.ndarray]:
    """Return the actions of the file and of the policy."""
    if acting.state_shape is None:
        return _played_at_once(run, policy, observations, masks)
    return _played_in_turn(run, acting, policy, observations)


def _masks(acting: PolicyModule) -> list[Arrays]:
    """Return the masks for all observations of each comparison."""
    if not acting.choices:
        return [()]
    masks = drawn_masks(acting, OBSERVATIONS)
    return [(masks,), (np.ones_like(masks),)]


def _difference(
    ours: np.ndarray, expected: np.ndarray, acting: PolicyModule, observations: dict[str, np.ndarray]
) -> float:
    """Return the largest difference between actions, as a share of the range; refuse one above tolerance."""
    if ours.shape != expected.shape:
        raise ExportError(
            f"the actions of the exported policy have the shape {ours.shape}, but those of the original "
            f"policy {expected.shape}; {_REMEDY}"
        )
    apart = _apart(ours, expected)
    span, allowed = _span_and_tolerance(acting, expected, magnitudes(acting, observations))
    if (apart > allowed).any():
        raise ExportError(
            f"the exported policy acts differently on {int((apart > allowed).sum())} of {apart.size} "
            f"numbers, by up to {apart.max():.3g}; {_REMEDY}"
        )
    return float((apart / span).max())


_REMEDY = "nothing was written; use load_policy in the program that needs this policy"
_NOTHING = "so a comparison would show nothing; normalize observations, train longer, or use load_policy"


def _apart(ours: np.ndarray, expected: np.ndarray) -> np.ndarray:
    return np.nan_to_num(np.abs(ours.astype(np.float64) - expected.astype(np.float64)), nan=np.inf)


def _refuse_what_shows_nothing(
    convert: Convert,
    acting: PolicyModule,
    policy: TrainedPolicy,
    observations: dict[str, np.ndarray],
    taken: np.ndarray,
) -> None:
    """Refuse actions at their bounds; refuse equal actions unless the scores show that the file is right."""
    rows = taken.reshape(len(taken), -1)
    same = bool((rows == rows[0]).all())
    if isinstance(acting.action_space, spaces.Box):
        low, high = acting.action_space.low, acting.action_space.high
        inside = ((taken > low) & (taken < high)).reshape(len(rows), -1).any(axis=1)
        if inside.sum() < _TELLING:
            raise ExportError(
                f"the policy's actions are at their bounds on {int((~inside).sum())} of {len(rows)} "
                f"observations, {_NOTHING}"
            )
    elif same and _scores_show(convert, Scoring(policy), observations):
        return
    if same:
        raise ExportError(f"the policy takes the same action on all {len(rows)} observations, {_NOTHING}")


def _scores_show(convert: Convert, scoring: Scoring, observations: dict[str, np.ndarray]) -> bool:
    """Return whether the scores of actions depend on the observations, and are the same in a file."""
    masks = map(torch.from_numpy, _masks(scoring)[-1])
    inputs = [*map(torch.from_numpy, observations.values()), *masks, *scoring.begin(OBSERVATIONS)]
    try:
        with torch.no_grad():
            expected = scoring(*inputs)[0].numpy()
    except AttributeError:  # a policy of the job's author may not have these networks
        return False
    (ours,) = convert(scoring)(*(part.numpy() for part in inputs))
    allowed = TOLERANCE * max(1.0, float(np.abs(expected).max()))
    return bool(
        np.ptp(expected, axis=0).max() > _TELLING * allowed >= _TELLING * _apart(ours, expected).max()
    )


def _span_and_tolerance(
    acting: PolicyModule, expected: np.ndarray, magnitude: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the range of each number of an action, and the largest allowed difference.

    If actions are only clipped, they may use a small part of the space's range. Then the range of the actual
    values counts, or 1 if that range is smaller, because the network may compute with numbers around 1.
    """
    space = acting.action_space
    if not isinstance(space, spaces.Box):
        return np.ones(1), np.zeros(1)
    low, high = (bound.astype(np.float64) for bound in (space.low, space.high))
    largest = np.maximum(np.abs(low), np.abs(high))
    with np.errstate(over="ignore"):
        span = high - low
    if not acting.policy.squash_output:
        largest = np.maximum(0.5, np.abs(expected).max(axis=0))
        span = np.minimum(span, np.maximum(1.0, np.ptp(expected, axis=0)))
    if acting.state_shape is not None:  # the state of a policy accumulates errors during an episode
        magnitude = np.maximum.accumulate(magnitude.reshape(-1, EPISODE), axis=1).ravel()
    rounding = 2 * np.spacing(largest.astype(np.float32)).astype(np.float64)
    rough = magnitude.reshape(-1, *[1] * span.ndim)
    return np.where(span > 0, span, 1.0), TOLERANCE * span * rough + rounding


def _played_at_once(
    run: Run, policy: TrainedPolicy, observations: Mapping[str, np.ndarray], masks: Arrays
) -> tuple[np.ndarray, np.ndarray]:
    (ours,) = run(*observations.values(), *masks)
    allowed = masks[0] if masks else None
    return ours, np.asarray(policy.predict(_whole(observations), action_masks=allowed)[0])


def _played_in_turn(
    run: Run, acting: PolicyModule, policy: TrainedPolicy, observations: Mapping[str, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the actions of file and policy; each step uses the state after the previous step."""
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
