"""Everything that palaestra raises.

    PalaestraError
    ├── TrainingJobError         a TrainingJob cannot be used
    │   ├── SpecErrors           the spec is wrong: never retried
    │   └── PlanError            the job cannot be planned (palaestra.plan.errors)
    ├── LocalError               the local runner cannot continue (palaestra.local.errors)
    ├── ApiError                 an API server returned an error, or no answer (palaestra.cluster.errors)
    └── NotConfigured            no API server is configured (palaestra.cluster.errors)

A message names the field, the fact and the remedy: `spec.steps: 0 is less than 1; use 1 or more`.
"""


class PalaestraError(Exception):
    """The base class of this package's errors."""


class TrainingJobError(PalaestraError):
    """A TrainingJob cannot be used as it stands."""


class SpecErrors(TrainingJobError, ValueError):
    """All the mistakes in one TrainingJob; retrying cannot help.

    Attributes:
        name: the path of the file that was read.
        problems: one line for each mistake, "<path>: <fact>; <remedy>"; never empty.
    """

    def __init__(self, name: str, problems: tuple[str, ...]) -> None:
        super().__init__("\n".join(problems))
        self.name = name
        self.problems = problems
