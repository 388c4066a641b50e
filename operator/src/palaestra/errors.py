"""Every error that palaestra raises.

    PalaestraError
    ├── TrainingJobError             a TrainingJob cannot be used in its current form
    │   ├── SpecErrors               the spec is invalid: never retried
    │   ├── JobRefused               the operator cannot run the job (decide.validation)
    │   └── PlanError                the job cannot be planned
    │       ├── WorldCheckTooCostly  the check of a world exceeds its budget
    │       ├── WorldRefused         a world is invalid
    │       └── WorldUnchecked       a world is not checked yet: retried after the check
    ├── LocalError                   the local runner cannot continue (local.errors)
    │   ├── RunRefused               the run cannot be started as requested
    │   ├── StartFailed              a container for which others wait did not start
    │   ├── StillRunning             a run in the background did not end within a deadline
    │   └── StorageFailed            a file of the run could not be written
    ├── ApiError                     a call of the API server failed (cluster.errors)
    │   ├── AlreadyExists            the name is taken
    │   ├── Conflict                 the object has changed since it was read
    │   ├── Forbidden                RBAC, a quota, Pod Security or a webhook refused
    │   │   └── NamespaceTerminating the namespace is being deleted
    │   ├── Gone                     the resource version or page has expired: list again
    │   ├── Invalid                  the object is wrong
    │   ├── NotFound                 no such object
    │   │   └── NoSuchKind           no such kind: its definition is not installed
    │   ├── ServerError              the API server or its store failed (5xx)
    │   ├── TooManyRequests          the API server is busy
    │   └── Unreachable              no readable response in time
    │       ├── ConnectionBroke      the connection broke; a read may be repeated (cluster.transport)
    │       └── Untrusted            the server's certificate is not trusted
    ├── NotConfigured                no API server is configured (cluster.errors)
    ├── CommandFailed                a command in a container failed (cluster.errors)
    ├── ClientError                  a command about a cluster's jobs failed (client.errors)
    │   ├── EndedOtherwise           the job ended in another phase than expected
    │   ├── HasEnded                 the job has ended, so it is not suspended, resumed or restarted
    │   ├── NoPod                    a replica has no pod or container to read
    │   ├── NoSuchJob                no such TrainingJob
    │   ├── NoSuchNamespace          no such namespace
    │   ├── NotFetched               a run could not be copied
    │   ├── NothingLost              no replica has lost its run, so no replica is restarted
    │   ├── NotInstalled             the cluster has no TrainingJobs
    │   ├── NotOfThisSweep           another job has the name of a sweep's trial (sweeps.cluster_backend)
    │   ├── QueueDecides             only Kueue suspends and resumes this job
    │   └── TookTooLong              a deadline passed
    ├── NoSuccess                    a sweep has no success rates to compare (sweeps.runner)
    ├── NotLeading                   this operator may have lost its Lease (operator.fenced_client)
    ├── Outdated                     the cluster has changed since the decision (operator.preconditions)
    ├── TooLarge                     a file is larger than the maximum for its kind (bounded_read)
    ├── UnknownField                 a TrainingJob has no such field (api.field_lookup)
    ├── ViewError                    a run cannot be shown (live_view.source)
    │   ├── NoRun                    the folder has no run with simulators (live_view.local_run)
    │   ├── NotNow                   the simulator does not respond now
    │   ├── NotShown                 the simulator describes no world
    │   └── ViserMissing             the optional package of the page is missing (live_view.view_process)
    ├── ZooError                     a file of RL-Baselines3-Zoo cannot be converted (zoo.hyperparameter_file)
    └── TrialFailed                  the trial's job did not succeed in time (smoke_test)

A message names the field, the fact and the remedy: `spec.trainer.steps: 0 is less than 1; use 1 or more`.
"""


class PalaestraError(Exception):
    """The base class of this package's errors."""


class TrainingJobError(PalaestraError):
    """A TrainingJob cannot be used in its current form."""


class SpecErrors(TrainingJobError, ValueError):
    """A TrainingJob has problems, all of which are listed; retrying cannot help.

    Attributes:
        name: the path of the file that was read.
        problems: one line for each problem, "<path>: <fact>; <remedy>"; never empty.
    """

    def __init__(self, name: str, problems: tuple[str, ...]) -> None:
        super().__init__("\n".join(problems))
        self.name = name
        self.problems = problems


class PlanError(TrainingJobError, ValueError):
    """The job cannot be planned in this layout; the message is `<field>: <fact>; <remedy>`."""


class WorldCheckTooCostly(PlanError):
    """The check of a world takes more time or memory than its budget; retrying cannot help."""


class WorldRefused(PlanError):
    """A check before the plan refused a world; the message is the check's message."""


class WorldUnchecked(PlanError):
    """A world was not checked yet, so the plan must wait for the check; the message is the world's field."""
