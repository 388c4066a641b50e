"""Compute the trials of a Sweep. The same Sweep always gives the same trials in the same order.

A random value is a function of the sweep's seed, the number of the trial and the field. So a new trial, a new
field or another version of Python does not change other values.
"""

import hashlib
import math
from collections.abc import Iterable, Iterator, Mapping
from itertools import product, zip_longest
from typing import Any

from palaestra.api import TrainingJob
from palaestra.errors import SpecErrors
from palaestra.job_input import changed
from palaestra.sweeps.model import LABEL, Distribution, Sweep
from palaestra.sweeps.trial import Trial

_BITS = 53  # the precision of a float


def trials(sweep: Sweep) -> tuple[Trial, ...]:
    """Return all trials, in order; for a search by Optuna, return the trials with the values of `probes`.

    Raises:
        SpecErrors: jobs are invalid; the error lists each problem once, with the first trial that has it.
    """
    points = list(settings(sweep) if sweep.spec.optuna is None else probes(sweep))
    found: list[Trial] = []
    problems: dict[str, str] = {}
    for number, changes in enumerate(points):
        try:
            found.append(trial(sweep, number, changes))
        except SpecErrors as error:
            for problem in error.problems:
                problems.setdefault(problem, f"trial {number}: {problem}")
    if problems:
        raise SpecErrors(sweep.metadata.name, tuple(problems.values()))
    return tuple(found)


def settings(sweep: Sweep) -> Iterator[Mapping[str, Any]]:
    """Yield the changed values of each trial; in a matrix, the last field varies fastest."""
    spec = sweep.spec
    if spec.random:
        for number in range(spec.trials or 0):
            yield {
                field: drawn(values, chance(spec.seed, number, field))
                for field, values in spec.random.items()
            }
        return
    for combination in product(*spec.matrix.values()):
        yield dict(zip(spec.matrix, combination, strict=True))


def trial(sweep: Sweep, number: int, changes: Mapping[str, Any]) -> Trial:
    """Return a trial; its job has the sweep's label and a replica for each seed.

    Raises:
        SpecErrors: the job is invalid; the error lists every problem.
    """
    job = sweep.spec.job
    own = {
        "metadata.name": f"{sweep.metadata.name}-{number}",
        f'metadata.labels["{LABEL}"]': sweep.metadata.name,
    }
    seeds = {} if sweep.spec.seeds is None else {"spec.replicas": sweep.spec.seeds}
    made: TrainingJob = changed(job, {**changes, **seeds, **own})
    return Trial(number=number, changes=changes, job=made)


def probes(sweep: Sweep) -> Iterator[Mapping[str, Any]]:
    """Yield values that together contain each bound and choice of `random`, to check jobs before a search."""
    columns = [_ends(values) for values in sweep.spec.random.values()]
    first = [column[0] for column in columns]
    for row in zip_longest(*columns):
        values = (start if value is None else value for start, value in zip(first, row, strict=True))
        yield dict(zip(sweep.spec.random, values, strict=True))


def drawn(values: Distribution, share: float) -> Any:
    """Return the value of a distribution at the share `share` of its range; 0 <= `share` < 1."""
    if values.choice is not None:
        return values.choice[int(share * len(values.choice))]
    low, high = float(values.low or 0), float(values.high or 0)
    if values.whole:
        value = math.floor(_between(low, high + 1, share, log=values.log))
        return min(max(value, int(low)), int(high))
    return min(max(_between(low, high, share, log=values.log), low), high)


def chance(seed: int, number: int, field: str) -> float:
    """Return a uniformly distributed number in [0, 1) that depends only on the arguments."""
    digest = hashlib.sha256(f"{seed}/{number}/{field}".encode()).digest()
    return (int.from_bytes(digest[:8]) >> (64 - _BITS)) / (1 << _BITS)


def short(fields: Iterable[str]) -> Mapping[str, str]:
    """Return for each path its shortest end that no other path has, for headings."""
    paths = list(fields)
    return {path: next(end for end in _endings(path) if end == path or _is_one(end, paths)) for path in paths}


def _endings(path: str) -> Iterator[str]:
    pieces = path.split(".")
    yield from (".".join(pieces[-count:]) for count in range(1, len(pieces) + 1))


def _is_one(end: str, paths: list[str]) -> bool:
    return sum(f".{path}".endswith(f".{end}") for path in paths) == 1


def _between(low: float, high: float, share: float, *, log: bool) -> float:
    if log:
        return math.exp(math.log(low) + share * (math.log(high) - math.log(low)))
    return low + share * (high - low)


def _ends(values: Distribution) -> tuple[Any, ...]:
    return values.choice if values.choice is not None else (values.low, values.high)
