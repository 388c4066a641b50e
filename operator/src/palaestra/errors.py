"""Everything that palaestra raises.

    PalaestraError
    ├── TrainingJobError         a TrainingJob cannot be used as it stands
    │   ├── SpecErrors           what its author wrote is wrong: never retried
    │   └── PlanError            no plan can be made of it (palaestra.plan.errors)
    ├── LocalError               the local runner cannot go on (palaestra.local.errors)
    ├── ApiError                 an API server answers otherwise, or not at all (palaestra.cluster.errors)
    └── NotConfigured            no API server is named (palaestra.cluster.errors)

A message names the field, the fact and the remedy: `spec.steps: 0 is less than 1; use 1 or more`.
"""


class PalaestraError(Exception):
    """Whatever this package raises on purpose."""


class TrainingJobError(PalaestraError):
    """A TrainingJob cannot be used as it stands."""


class SpecErrors(TrainingJobError, ValueError):
    """All the mistakes in one TrainingJob; retrying cannot help.

    Attributes:
        name: what was read, as its author knows it: the path of a file.
        problems: one line for each mistake, "<path>: <fact>; <remedy>"; never empty.
    """

    def __init__(self, name: str, problems: tuple[str, ...]) -> None:
        super().__init__("\n".join(problems))
        self.name = name
        self.problems = problems
