"""Load a TrainingJob from YAML or plain data, report all problems at once, and dump a TrainingJob.

Pydantic does not check the rules of an object with a wrong field. So this module reports and removes each
wrong field, and validates the remaining fields again until they are valid. Then it checks the rules, except
for rules that read a removed field.
"""

import re
from collections.abc import Mapping
from typing import Any

from pydantic import ValidationError

from palaestra.api.job import API_VERSION, KIND, TrainingJob
from palaestra.api.model import FIELDS_ONLY, Rule
from palaestra.api.model_walk import objects
from palaestra.api.paths import Path, Pruned, shown
from palaestra.api.validation_messages import quoted, sentence
from palaestra.api.yaml_io import NotYaml, read, write
from palaestra.errors import SpecErrors

_NOT_EXACT = 2.0**53  # from this number on, several whole numbers may have the same nearest float
_KEY = "[key]"  # last item of pydantic's path if the key of a mapping is wrong

_HEADING = (("apiVersion", API_VERSION), ("kind", KIND))

# These objects replace required objects that are wrong as a whole, so that the other fields can be validated.
_STAND_INS: dict[Path, Any] = {("metadata",): {"name": "stand-in"}, ("spec",): {}}


def load(text: str, name: str = "job") -> TrainingJob:
    """Return the TrainingJob in `text`, one YAML document; `name` is the path of its file.

    Raises:
        SpecErrors: the job is invalid; the error lists every problem, or only the first problem if the text
            is not YAML.
    """
    try:
        data = read(text, name)
    except NotYaml as error:
        raise SpecErrors(name, (error.problem,)) from None
    return validate(data, name)


def validate(data: Any, name: str = "job") -> TrainingJob:
    """Return the TrainingJob in plain `data`, for example in the response of an API server.

    A float with a whole value counts as a whole number, as in an API server, which stores 1e6 as 1000000.

    Raises:
        SpecErrors: the job is invalid; the error lists every problem.
    """
    data = _stored(data)
    if not isinstance(data, Mapping):
        fact = "empty" if data is None else f"{quoted(data)}, not a mapping"
        problem = f"{name}: the document is {fact}; begin it with apiVersion: {API_VERSION}"
        raise SpecErrors(name, (problem,))
    other = [
        f"{key}: {_unsupported(data[key], ours)}"
        for key, ours in _HEADING
        if key in data and data[key] != ours
    ]
    if len(other) == len(_HEADING):  # the object is of another kind, so its fields are not checked
        raise SpecErrors(name, tuple(other))
    missing = [f"{key}: is missing; add {key}: {ours}" for key, ours in _HEADING if key not in data]
    job, problems = _examine(data)
    if job is None or missing or problems:
        raise SpecErrors(name, (*missing, *problems))
    return job


def broken_guards(job: TrainingJob) -> tuple[str, ...]:
    """Return a line for each guard that a job breaks: its field, the fact and the remedy."""
    return tuple(
        f"{shown((*place, *guard.field.split('.')))}: {guard.message}"
        for place, part in objects(job)
        for guard in part.guards
        if not guard.holds(part)
    )


def dump(job: TrainingJob) -> str:
    """Return the job as YAML with its defaults; absent fields are omitted."""
    return write(as_data(job))


def as_data(job: TrainingJob) -> dict[str, Any]:
    """Return the job as plain data in camelCase with its defaults; absent fields are omitted."""
    return job.model_dump(mode="json", by_alias=True, exclude_none=True)


def _stored(data: Any) -> Any:
    if isinstance(data, Mapping):
        return {key: _stored(value) for key, value in data.items()}
    if isinstance(data, list | tuple):
        return [_stored(value) for value in data]
    exact = isinstance(data, float) and data.is_integer() and abs(data) < _NOT_EXACT
    return int(data) if exact else data


def _unsupported(value: Any, ours: str) -> str:
    return f"{quoted(value)} is not known; use {ours}"


def _examine(data: Mapping[str, Any]) -> tuple[TrainingJob | None, list[str]]:
    """Return the job without its wrong fields, or None if it is unusable, and a line for each problem."""
    pruned = Pruned(data)
    removed: list[Path] = []
    problems: list[str] = []
    while True:
        try:
            job = TrainingJob.model_validate(pruned.data(), by_alias=True, by_name=False, context=FIELDS_ONLY)
        except ValidationError as error:
            found = [
                (pruned.original(_place(detail["loc"])), detail) for detail in error.errors(include_url=False)
            ]
            for path, detail in found:
                if not (detail["type"] in _CONSEQUENCES and _touches(path, removed)):
                    problems.append(f"{shown(path)}: {sentence(path, detail)}")
            if not _remove(pruned, [path for path, _ in found], removed):
                return None, problems
            continue
        return job, problems + _broken_rules(job, pruned, removed)


# The types of errors that may be consequences of a removed field.
_CONSEQUENCES = {"missing", "too_short"}


def _place(loc: tuple[int | str, ...]) -> Path:
    return loc[:-1] if loc[-1:] == (_KEY,) else loc


def _touches(path: Path, removed: list[Path]) -> bool:
    """Return whether `path` was removed, or contains a removed field."""
    return any(other[: len(path)] == path for other in removed)


def _remove(pruned: Pruned, paths: list[Path], removed: list[Path]) -> bool:
    """Remove the wrong fields or their nearest existing parents; return whether a field was removed."""
    before = len(removed)
    for path in paths:
        if any(path[: len(other)] == other != path for other in removed):
            continue  # a field that contains this field was removed
        gone = path
        while gone and not pruned.take(gone, _STAND_INS.get(gone)):
            gone = gone[:-1]
        if not gone:
            return False
        removed.append(gone)
    return len(removed) > before


def _broken_rules(job: TrainingJob, pruned: Pruned, removed: list[Path]) -> list[str]:
    problems = []
    for place, part in objects(job):
        path = pruned.original(place)
        for rule in part.rules:
            if not _reads_removed(rule, path, removed) and not rule.holds(part):
                field = (*path, *rule.field.split(".")) if rule.field else path
                problems.append(f"{shown(field)}: {rule.message}")
    return problems


def _reads_removed(rule: Rule, path: Path, removed: list[Path]) -> bool:
    """Return whether the rule reads a removed field of the object at `path`."""
    named = {*rule.reads, *re.findall(r"\w+", rule.cel)}
    below = [other[len(path) :] for other in removed if other[: len(path)] == path]
    return any(named.issuperset(p for p in rest if isinstance(p, str)) for rest in below)
