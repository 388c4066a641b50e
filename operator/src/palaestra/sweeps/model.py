"""The Sweep: a job, the fields that differ between its trials, and their values.

Only the command line reads a Sweep. A cluster stores only the TrainingJobs of its trials.
"""

from collections.abc import Mapping
from enum import StrEnum
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field, ValidationError

from palaestra.api.fields import JobName
from palaestra.api.job import API_VERSION
from palaestra.api.model import ApiModel, Rule, RulesBroken
from palaestra.api.model_walk import fields_of, model_at
from palaestra.api.paths import shown
from palaestra.api.validation_messages import sentence
from palaestra.api.yaml_io import NotYaml, read
from palaestra.bounded_read import MOST_JOB_BYTES, read_bounded
from palaestra.errors import SpecErrors
from palaestra.job_input import data_of, full_path

LABEL = "palaestra.dev/sweep"
MOST_TRIALS = 1000
Number = int | float


class Objective(StrEnum):
    """The figure by which trials are compared; a larger figure is better."""

    SUCCESS_RATE = "SuccessRate"
    MEAN_RETURN = "MeanReturn"


class Distribution(ApiModel):
    """The distribution of a field's random values: a range, or a choice."""

    low: Number | None = None
    """Least value of a range. If `low` and `high` are whole numbers, all values are whole numbers."""

    high: Number | None = None
    """Largest value of a range."""

    log: bool = False
    """`true` draws from the range on a logarithmic scale; `low` must then be more than 0."""

    choice: Annotated[tuple[Any, ...], Field(min_length=1, strict=False)] | None = None
    """Values to choose from."""

    rules = (
        Rule(
            holds=lambda values: (values.choice is None) != (values.low is None and values.high is None),
            message="needs low and high, or choice; give one of them",
        ),
        Rule(
            holds=lambda values: (values.low is None) == (values.high is None),
            message="has only one of low and high; give both",
        ),
        Rule(
            holds=lambda values: None in {values.low, values.high} or values.low < values.high,
            message="low is not less than high; exchange them",
        ),
        Rule(
            holds=lambda values: not values.log or (values.low is not None and values.low > 0),
            message="log needs a low above 0; raise low, or remove log",
        ),
    )

    @property
    def whole(self) -> bool:
        """Return whether all values are whole numbers."""
        return isinstance(self.low, int) and isinstance(self.high, int)


class Optuna(ApiModel):
    """How Optuna searches; its sampler is TPE with the sweep's seed."""

    prune: bool = True
    """`true` stops a trial whose figure is below the median of earlier trials at the same step."""

    startup_trials: Annotated[int, Field(ge=0, le=MOST_TRIALS)] = 5
    """Number of trials that must be complete before Optuna searches and prunes; they have random values."""

    warmup_steps: Annotated[int, Field(ge=0)] = 0
    """Environment steps before a trial can be pruned."""


class SweepSpec(ApiModel):
    """The job, the values to try, and how they are compared."""

    job: str | dict[str, Any]
    """The TrainingJob, or the path of its file, relative to the file of the Sweep."""

    matrix: dict[str, Annotated[tuple[Any, ...], Field(min_length=1, strict=False)]] = Field(default={})
    """Values by the path of their field; every combination is a trial."""

    random: dict[str, Distribution] = Field(default={})
    """Distributions by the path of their field; each trial draws one value from each distribution."""

    trials: Annotated[int, Field(ge=1, le=MOST_TRIALS)] | None = None
    """Number of trials, with `random` only. The number may be raised later."""

    seed: Annotated[int, Field(ge=0)] = 1
    """Seed of the random draws."""

    seeds: Annotated[int, Field(ge=1, le=100)] | None = None
    """Runs of each trial, with different seeds; absent: `spec.replicas` of the job."""

    objective: Objective = Field(default=Objective.SUCCESS_RATE, strict=False)
    """Figure by which trials are compared."""

    optuna: Optuna | None = None
    """Search by Optuna instead of independent random draws; needs `random`."""

    rules = (
        Rule(
            holds=lambda spec: bool(spec.matrix) != bool(spec.random),
            message="needs either matrix or random; give one of them",
        ),
        Rule(
            field="trials",
            holds=lambda spec: (spec.trials is not None) == bool(spec.random),
            message="is the number of random trials; set it if random is set, and only then",
        ),
        Rule(
            field="optuna",
            holds=lambda spec: spec.optuna is None or bool(spec.random),
            message="searches only in random; replace matrix by random, or remove optuna",
        ),
    )


class SweepName(ApiModel):
    """Name of the sweep."""

    name: Annotated[JobName, Field(max_length=40)]
    """Name of the sweep; its jobs are `<name>-<number>`."""


class Sweep(ApiModel):
    """Many trainings that differ in some fields."""

    api_version: Literal["palaestra.dev/v1alpha1"] = API_VERSION
    kind: Literal["Sweep"] = "Sweep"
    metadata: SweepName
    spec: SweepSpec


def load(file: Path) -> Sweep:
    """Return the Sweep in a file, with its job as plain data.

    Raises:
        SpecErrors: the Sweep is invalid; the error lists every problem.
        OSError: the file, or the file of its job, cannot be read.
        TooLarge: one of the two files is too large.
    """
    try:
        data = read(read_bounded(file, MOST_JOB_BYTES).decode(), str(file))
    except NotYaml as error:
        raise SpecErrors(str(file), (error.problem,)) from None
    sweep = _validated(data, str(file))
    if isinstance(sweep.spec.job, str):
        job = data_of(file.parent / sweep.spec.job)
        sweep = sweep.model_copy(update={"spec": sweep.spec.model_copy(update={"job": job})})
    return sweep


def _validated(data: Any, name: str) -> Sweep:
    if not isinstance(data, Mapping) or data.get("kind") != "Sweep":
        raise SpecErrors(
            name, (f"{name}: is not a Sweep; begin it with apiVersion: {API_VERSION}, kind: Sweep",)
        )
    try:
        sweep = Sweep.model_validate(data, by_alias=True, by_name=False)
    except ValidationError as error:
        problems = (problem for detail in error.errors(include_url=False) for problem in _problems(detail))
        raise SpecErrors(name, tuple(dict.fromkeys(problems))) from None
    fields = {**sweep.spec.matrix, **sweep.spec.random}
    if wrong := [field for field in fields if full_path(field)[:1] != ("spec",)]:
        raise SpecErrors(
            name,
            tuple(
                f"{field!r}: is not the path of a field; write it as in spec.trainer.steps" for field in wrong
            ),
        )
    return sweep


def _problems(detail: Any) -> list[str]:
    path = detail["loc"]
    broken = detail.get("ctx", {}).get("error")
    if isinstance(broken, RulesBroken):
        return [
            f"{shown((*path, *rule.field.split('.')) if rule.field else path)}: {rule.message}"
            for rule in broken.rules
        ]
    if detail["type"] == "extra_forbidden":
        model = model_at(Sweep, path[:-1])
        return [f"{shown(path)}: is not a field; use {', '.join(fields_of(model)) if model else 'another'}"]
    return [f"{shown(path)}: {sentence(path, detail)}"]
