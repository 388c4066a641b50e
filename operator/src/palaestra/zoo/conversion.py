"""Convert one entry of a file of RL-Baselines3-Zoo to a TrainingJob."""

import re
from dataclasses import dataclass
from pathlib import PurePath
from typing import Any

from palaestra.api import API_VERSION, KIND, validate
from palaestra.api.trainer import OWN_TASKS
from palaestra.api.yaml_io import write
from palaestra.zoo.draft import Draft
from palaestra.zoo.hyperparameter_file import ZooError, algorithm_of, entry_of, read_file
from palaestra.zoo.mapping import note_together, put

_LONGEST_NAME = 48
_OWN_DEFAULTS = "MoveToTargetEnv-v0"  # the trainer has its own default hyperparameters for this environment


@dataclass(frozen=True, slots=True, kw_only=True)
class Converted:
    """A TrainingJob from an entry.

    Attributes:
        text: the job as YAML; its comments have the notes.
        notes: one line for each difference between the job and Zoo.
    """

    text: str
    notes: tuple[str, ...]


def convert(text: str, name: str, *, env: str | None = None, algorithm: str | None = None) -> Converted:
    """Return the TrainingJob of one entry.

    Args:
        text: the content of the file.
        name: the path of the file; the file's name is the name of the algorithm.
        env: id of the environment; None: the only environment in the file.
        algorithm: name of the algorithm; None: the algorithm of the file.

    Raises:
        ZooError: the file does not have the entry, or its algorithm cannot be used here.
        SpecErrors: a value of the entry is not valid in a TrainingJob.
    """
    environment, entry, chosen = entry_of(read_file(text, name), name, env)
    draft = Draft(
        entry=entry, environment=environment, algorithm={"name": algorithm_of(algorithm, name, entry)}
    )
    if chosen != environment:
        draft.note("--env", f"{name} has no entry {environment}; as in Zoo, the job uses the entry {chosen}")
    for word, value in entry.items():
        put(draft, word, value)
    note_together(draft)
    if draft.steps is None:
        raise ZooError(f"{name}: the entry {chosen} has no n_timesteps; add it")
    _note_the_environment(draft)
    job = {
        "apiVersion": API_VERSION,
        "kind": KIND,
        "metadata": {"name": _job_name(draft)},
        "spec": draft.spec(),
    }
    validate(job, name)
    return Converted(text=_commented(job, draft, name), notes=tuple(draft.notes))


def _note_the_environment(draft: Draft) -> None:
    if draft.environment == _OWN_DEFAULTS:
        draft.note(
            "defaults",
            f"for {_OWN_DEFAULTS}, hyperparameters that the entry leaves out have defaults of Palaestra; "
            "docs/reference/trainingjob.md lists them, so write the values that you want",
        )
    elif draft.environment not in OWN_TASKS:
        draft.note(
            "environment",
            f"{draft.environment} must accept robot or scene to use a simulator "
            "(docs/reference/environment-rules.md); "
            "change environment.id, simulators[].world and trainer.robot to yours",
        )


def _job_name(draft: Draft) -> str:
    """Return a DNS label of algorithm and environment."""
    words = re.sub("[^a-z0-9]+", "-", f"{draft.name}-{draft.environment}".lower()).strip("-")
    return words[:_LONGEST_NAME].strip("-")


def _commented(job: dict[str, Any], draft: Draft, name: str) -> str:
    file = ascii(PurePath(name).name).strip("'")
    lines = [f"{draft.environment} of {file}, a file of RL-Baselines3-Zoo, by `palaestra from-zoo`."]
    if draft.notes:
        lines += ["What differs:", *(f"- {note}" for note in draft.notes)]
    return "".join(f"# {line}\n" for line in lines) + write(job)
