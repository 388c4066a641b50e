"""The measured success of a policy, for the manifest of its package: each result with its simulator."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Final

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.run_directory import RunDirectory, read_lines
from palaestra_trainer.run.best_record import measured
from palaestra_trainer.run.versions import SIMULATING

MOST_BYTES: Final = 2**20
_REMEDY: Final = "write the file with `palaestra-eval RUN --in NAMES --json`"
_Rate = Annotated[float, Field(ge=0.0, le=1.0)]
_Name = Annotated[str, Field(min_length=1, max_length=255)]


class _Interval(BaseModel):
    low: _Rate
    high: _Rate
    episodes: Annotated[int, Field(ge=1)]


class Measurement(BaseModel):
    """A result of `palaestra-eval`; its other fields are ignored.

    Attributes:
        simulators: the programs in which the policy played.
        worlds: the names of the files of their worlds.
        episodes: number of episodes.
        success_rate: share of successful episodes; None if the task counts no success.
        success_interval: the 95 % interval of the rate.
        seeds: name of the stream of seeds: A selects the model of a run, C confirms it.
        versions: versions of the programs.
    """

    model_config = ConfigDict(extra="ignore", allow_inf_nan=False)

    simulators: Annotated[list[_Name], Field(min_length=1, max_length=8)]
    worlds: Annotated[list[_Name], Field(max_length=64)]
    episodes: Annotated[int, Field(ge=1)]
    success_rate: _Rate | None
    success_interval: _Interval | None
    seeds: _Name | None = None
    versions: Annotated[dict[_Name, _Name], Field(max_length=16)] = {}


def own_result(configuration: Configuration, run: RunDirectory) -> list[dict[str, Any]]:
    """Return the result of the run's own evaluation as a list of one; empty without an evaluation."""
    result = measured(run)
    if not result:
        return []
    judges = [it for it in configuration.simulators if it.role is Role.EVALUATE]
    versions: Mapping[str, str] = {}
    for attempt in read_lines(run.attempts):
        versions = attempt.get("versions") or versions
    return [
        {
            "simulators": sorted({it.driver for it in judges}),
            "worlds": sorted({Path(it.world).name for it in judges}),
            "episodes": result.get("episodes"),
            "success_rate": result.get("success_rate"),
            "success_interval": result.get("success_interval"),
            "seeds": "C" if "confirmed_at" in result else "A",
            "versions": {name: versions[name] for name in SIMULATING if name in versions},
        }
    ]


def results_of(file: Path, model: Path) -> list[dict[str, Any]]:
    """Return the results in a file of JSON lines of `palaestra-eval`.

    Args:
        file: the file.
        model: the model to which the results must belong.

    Raises:
        ConfigurationError: the file is too large, or a line is not a result, or is one of another policy.
        OSError: a file cannot be read.
    """
    with file.open("rb") as lines:
        text = lines.read(MOST_BYTES + 1)
    if len(text) > MOST_BYTES:
        raise ConfigurationError(f"{file}: has more than {MOST_BYTES:,} bytes; {_REMEDY}")
    digest = hashlib.sha256(model.read_bytes()).hexdigest()
    found = [
        _result(line, f"{file}: line {number}", digest) for number, line in enumerate(text.splitlines(), 1)
    ]
    if not found:
        raise ConfigurationError(f"{file}: is empty; {_REMEDY}")
    return found


def _result(line: bytes, place: str, digest: str) -> dict[str, Any]:
    try:
        content = json.loads(line)
        result = Measurement.model_validate(content)
    except (ValidationError, ValueError, RecursionError) as error:
        raise ConfigurationError(
            f"{place}: is not a result of a policy ({type(error).__name__}); {_REMEDY}"
        ) from error
    if content.get("model") != digest:
        raise ConfigurationError(
            f"{place}: is a result of another policy, not of model.zip; evaluate model.zip again"
        )
    return result.model_dump()
