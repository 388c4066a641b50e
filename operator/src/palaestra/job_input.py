"""Read a job that a program gives as the path of a file, YAML text, plain data or the model.

`changed` returns a job with other values in some fields, and checks it like a file. The function does not
change its arguments, and does not start a run.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from palaestra.api import API_VERSION, KIND, Metadata, Spec, TrainingJob, as_data, validate
from palaestra.api.paths import Pruned, path_of, shown
from palaestra.api.yaml_io import NotYaml, read
from palaestra.bounded_read import MOST_JOB_BYTES, read_bounded
from palaestra.errors import SpecErrors

Given = TrainingJob | Mapping[str, Any] | Path | str

_ROOTS = ("metadata", "spec")


def job_of(job: Given) -> TrainingJob:
    """Return the job as a model; a text of one line is the path of a file.

    Raises:
        SpecErrors: the job is invalid; the error lists every problem.
        OSError: the file cannot be read.
        TooLarge: the file is too large for a job.
    """
    return job if isinstance(job, TrainingJob) else validate(data_of(job), name_of(job))


def changed(job: Given, changes: Mapping[str, Any]) -> TrainingJob:
    """Return the job with other values in some fields; the given job does not change.

    Args:
        job: the job, as the path of a file, YAML text, plain data or the model.
        changes: the new values by the paths of their fields; docs/reference/trainingjob.md lists the paths. A
            path may omit `spec.`: `{"trainer.algorithm.hyperparameters.learning_rate": 1e-3}`.

    Raises:
        SpecErrors: a path or a value is invalid; the error lists every problem.
        OSError: the file cannot be read.
        TooLarge: the file is too large for a job.
    """
    data = Pruned(data_of(job)).data()  # a copy of the job's data
    if not isinstance(data, dict):
        return validate(data, name_of(job))
    problems = [problem for path, value in changes.items() if (problem := _put(data, path, value))]
    if problems:
        raise SpecErrors(name_of(job), tuple(problems))
    return validate(data, name_of(job))


def data_of(job: Given) -> Any:
    """Return a job as plain data, with only the fields that were given.

    Raises:
        SpecErrors: the text is not YAML.
        OSError: the file cannot be read.
        TooLarge: the file is too large for a job.
    """
    if isinstance(job, TrainingJob):
        given = job.model_dump(mode="json", by_alias=True, exclude_unset=True, exclude={"status"})
        return {**given, "apiVersion": API_VERSION, "kind": KIND}
    if isinstance(job, Mapping):
        return job
    is_text = isinstance(job, str) and "\n" in job
    text = str(job) if is_text else read_bounded(Path(job), MOST_JOB_BYTES).decode()
    try:
        return read(text, name_of(job))
    except NotYaml as error:
        raise SpecErrors(name_of(job), (error.problem,)) from None


def name_of(job: Given) -> str:
    """Return the name of a job for messages: the path of its file, or `job`."""
    return str(job) if isinstance(job, Path) or (isinstance(job, str) and "\n" not in job) else "job"


def full_path(text: str) -> tuple[str | int, ...]:
    """Return the path of a field, starting at the job's top level; empty if `text` is not a path."""
    path = path_of(text)
    return path if not path or path[0] in _ROOTS else ("spec", *path)


def _put(data: Any, text: str, value: Any) -> str | None:
    """Set a field in plain data; return a problem if the path cannot exist in the data, else None.

    If the data has another value where the path needs a mapping, an empty mapping replaces this value. The
    check of the whole job then reports the field.
    """
    path = full_path(text)
    if not path:
        return f"{text!r}: is not the path of a field; write it as in spec.trainer.steps"
    for end, (piece, next_piece) in enumerate(zip(path, (*path[1:], None), strict=True), start=1):
        if isinstance(piece, int) and piece >= len(data):
            return f"{shown(path[:end])}: the list has {len(data)} entries; use an index below {len(data)}"
        if next_piece is None:
            data[piece] = value
            return None
        below = data.get(piece) if isinstance(piece, str) else data[piece]
        if not isinstance(below, list if isinstance(next_piece, int) else dict):
            below = data[piece] = _default(path[:end]) if isinstance(next_piece, int) else {}
        data = below
    return None


def _default(path: tuple[str | int, ...]) -> list[Any]:
    """Return the default list at `path`, which a job has if its author does not set the list."""
    found: Any = as_data(TrainingJob(metadata=Metadata(name="a"), spec=Spec()))
    for piece in path:
        found = found.get(piece) if isinstance(found, dict) else None
    return found if isinstance(found, list) else []
