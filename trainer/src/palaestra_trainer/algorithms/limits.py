"""The ranges of hyperparameters; outside of these ranges, an algorithm fails later or does not learn.

The algorithms themselves check few of these values, and most of these few only in `learn`, after the
simulators have started.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

_EPISODES = "episode"


@dataclass(frozen=True, slots=True)
class Range:
    """The range of values that a hyperparameter may have.

    Attributes:
        least: the smallest allowed number.
        most: the greatest allowed number; None: no upper limit.
        open: whether `least` itself is not allowed.
    """

    least: float
    most: float | None = None
    open: bool = False

    def __contains__(self, value: float) -> bool:
        """Return whether a number is in the range; NaN is never in a range."""
        enough = value > self.least if self.open else value >= self.least
        return enough and (self.most is None or value <= self.most)

    def __str__(self) -> str:
        """Return the range as text for a message."""
        if self.most is not None:
            return f"{self.least:g} to {self.most:g}"
        return f"a number {'above' if self.open else 'of at least'} {self.least:g}"


SHARE, POSITIVE, NOT_NEGATIVE, COUNT = Range(0, 1), Range(0, open=True), Range(0), Range(1)
RANGES: Mapping[str, Range] = {
    "batch_size": COUNT,
    "buffer_size": COUNT,
    "cg_damping": NOT_NEGATIVE,
    "cg_max_steps": COUNT,
    "clip_range": POSITIVE,
    "clip_range_vf": POSITIVE,
    "episodes_per_update": COUNT,
    "exploration_final_eps": SHARE,
    "exploration_fraction": SHARE,
    "exploration_initial_eps": SHARE,
    "gae_lambda": SHARE,
    "gamma": SHARE,
    "learning_rate": POSITIVE,
    "learning_starts": NOT_NEGATIVE,
    "line_search_max_iter": COUNT,
    "line_search_shrinking_factor": POSITIVE,
    "max_grad_norm": POSITIVE,
    "n_critic_updates": COUNT,
    "n_epochs": COUNT,
    "n_steps": COUNT,
    "policy_delay": COUNT,
    "rms_prop_eps": POSITIVE,
    "stats_window_size": COUNT,
    "sub_sampling_factor": COUNT,
    "target_kl": POSITIVE,
    "target_noise_clip": NOT_NEGATIVE,
    "target_policy_noise": NOT_NEGATIVE,
    "target_update_interval": COUNT,
    "tau": SHARE,
    "top_quantiles_to_drop_per_net": NOT_NEGATIVE,
    "vf_coef": NOT_NEGATIVE,
}
RANGES_OF_POLICY: Mapping[str, Range] = {
    "batch_norm_eps": POSITIVE,
    "lstm_hidden_size": COUNT,
    "n_critics": COUNT,
    "n_lstm_layers": COUNT,
    "n_quantiles": COUNT,
}
# Batch normalization and the standard deviation of advantages need at least two rows.
LEAST_BATCH: Mapping[str, int] = {"CrossQ": 2, "RecurrentPPO": 2, "MaskablePPO": 2}


def out_of_range(cls: type, given: Mapping[str, Any]) -> Iterator[tuple[str, str]]:
    """Yield name and fact of each number that is out of its range; ignore values of other types.

    Args:
        cls: class of the algorithm; a subclass has the ranges of the class that it extends.
        given: hyperparameters by name.
    """
    ranges = dict(RANGES)
    for ancestor in cls.__mro__:
        if ancestor.__name__ in LEAST_BATCH:
            ranges["batch_size"] = Range(LEAST_BATCH[ancestor.__name__])
    yield from _outside("", given, ranges)
    if given.get("gradient_steps") == 0:
        yield (
            "gradient_steps",
            "with 0 nothing is learned; give a number above 0, or -1 for one per environment step",
        )
    policy = given.get("policy_kwargs")
    if isinstance(policy, dict):
        yield from _outside("policy_kwargs.", policy, RANGES_OF_POLICY)
        yield from _layers(policy.get("net_arch"))
    frequency = given.get("train_freq")
    if (number := _first(frequency)) is not None and number not in COUNT:
        yield "train_freq", f"{frequency!r} is refused; give {COUNT}"


def needs_one_member(given: Mapping[str, Any]) -> bool:
    """Return whether `train_freq` counts episodes; that works only with one collecting simulator."""
    frequency = given.get("train_freq")
    return isinstance(frequency, list | tuple) and frequency[-1] == _EPISODES


def _outside(prefix: str, given: Mapping[str, Any], ranges: Mapping[str, Range]) -> Iterator[tuple[str, str]]:
    for name, value in given.items():
        if name in ranges and _is_number(value) and value not in ranges[name]:
            yield f"{prefix}{name}", f"{value!r} is refused; give {ranges[name]}"


def _layers(layers: Any) -> Iterator[tuple[str, str]]:
    """Yield name and fact of each invalid layer width in a list, or in a dict of lists by network."""
    lists = layers.values() if isinstance(layers, dict) else [layers]
    for widths in lists:
        for width in widths if isinstance(widths, list) else ():
            if _is_number(width) and width not in COUNT:
                yield "policy_kwargs.net_arch", f"a layer of {width!r} is refused; give {COUNT}"


def _first(frequency: Any) -> Any:
    """Return the number of `train_freq`, given alone or in a list with its unit; None without a number."""
    value = frequency[0] if isinstance(frequency, list | tuple) and frequency else frequency
    return value if _is_number(value) else None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and not math.isinf(value)
