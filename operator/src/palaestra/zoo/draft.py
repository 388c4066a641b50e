"""The TrainingJob during the conversion, and notes about settings that a job cannot represent exactly."""

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

MOST_OF_A_GROUP = 16
MOST_COLLECTING = 31  # one of the 32 simulators of a pod evaluates


@dataclass(slots=True, kw_only=True)
class Draft:
    """A TrainingJob that the keys of an entry fill.

    Attributes:
        entry: the whole entry, because some keys change the meaning of other keys.
        environment: id of the environment.
        algorithm: fields of `trainer.algorithm`, without `hyperparameters`.
        hyperparameters: the keyword arguments of the algorithm's class.
        options: the keyword arguments of the environment.
        wrappers: `name` and `options` of each wrapper of the environment.
        frame_stack: number of observations that are stacked.
        collecting: number of collecting simulators.
        steps: length of training in environment steps.
        seed: seed of the job; None: the job's default.
        notes: "<key>: <fact>; <remedy>" for each difference from the entry.
    """

    entry: Mapping[str, Any]
    environment: str
    algorithm: dict[str, Any]
    hyperparameters: dict[str, Any] = field(default_factory=dict)
    options: dict[str, Any] = field(default_factory=dict)
    wrappers: list[dict[str, Any]] = field(default_factory=list)
    frame_stack: int | None = None
    collecting: int = 1
    steps: int | None = None
    seed: int | None = None
    notes: list[str] = field(default_factory=list)

    @property
    def name(self) -> str:
        """Name of the algorithm."""
        return str(self.algorithm["name"])

    def note(self, word: str, fact: str) -> None:
        """Add a note about a key of the entry, as one line of printable ASCII characters."""
        self.notes.append(" ".join(re.sub(r"[^ -~]+", " ", f"{word}: {fact}").split()))

    def spec(self) -> dict[str, Any]:
        """Return the spec of the job, with only the fields that differ from the defaults."""
        algorithm = {**self.algorithm}
        if self.hyperparameters:
            algorithm["hyperparameters"] = self.hyperparameters
        environment: dict[str, Any] = {"id": self.environment}
        if self.options:
            environment["options"] = self.options
        if self.wrappers:
            environment["wrappers"] = self.wrappers
        if self.frame_stack is not None:
            environment["frameStack"] = self.frame_stack
        trainer = {"environment": environment, "algorithm": algorithm}
        steps = {} if self.steps is None else {"steps": self.steps}
        seed = {} if self.seed is None else {"seed": self.seed}
        return {**seed, "simulators": self._groups(), "trainer": {**trainer, **steps}}

    def _groups(self) -> list[dict[str, Any]]:
        """Return the groups of simulators; a collecting group has at most 16 simulators."""
        first = min(self.collecting, MOST_OF_A_GROUP)
        groups: list[dict[str, Any]] = [{"name": "collect", "role": "Collect", "count": first}]
        if rest := self.collecting - first:
            groups.append({"name": "collect-more", "role": "Collect", "count": rest})
        return [*groups, {"name": "evaluate", "role": "Evaluate"}]
