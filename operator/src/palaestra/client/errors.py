"""What a client of a cluster can be told instead of what it asked for.

ClientError
├── NotInstalled        the cluster does not know TrainingJobs
├── NoSuchNamespace     the namespace does not exist
├── NoSuchJob           there is no such TrainingJob, or it was deleted meanwhile
├── QueueDecides        a job in a queue is suspended and resumed by Kueue alone
├── EndedOtherwise      the job ended, and not as it was waited for
├── TookTooLong         a deadline passed; the same call may be made again
├── NoPod               a replica has no pod, or no such container, whose log could be read
└── NotFetched          a run could not be copied; nothing was written

What the API server itself refuses is an ApiError (palaestra.cluster.errors).
"""

from typing import Self

from palaestra.api.job import API_VERSION
from palaestra.errors import PalaestraError

INSTALL = "`palaestra crd | kubectl apply --server-side -f -`"


class ClientError(PalaestraError):
    """A cluster does not have, or do, what it was asked for."""


class NotInstalled(ClientError):
    """The cluster does not know TrainingJobs; retrying cannot help."""

    def __init__(self) -> None:
        super().__init__(
            f"{API_VERSION}: the cluster does not know TrainingJobs; install them with {INSTALL}, or choose "
            "another cluster with --context; `palaestra doctor` tells what else is missing"
        )


class NoSuchNamespace(ClientError, LookupError):
    """The namespace does not exist."""

    @classmethod
    def of(cls, name: str) -> Self:
        """Return the error about a namespace of this name."""
        return cls(
            f"namespace {name}: does not exist; choose another with -n, `kubectl get namespaces` lists them"
        )


class NoSuchJob(ClientError, LookupError):
    """There is no such TrainingJob, or it was deleted meanwhile."""

    @classmethod
    def of(cls, name: str, namespace: str) -> Self:
        """Return the error about a job of this name."""
        return cls(
            f"job {name}: there is none in namespace {namespace}; "
            "`palaestra get` lists those of a namespace, -A those of all"
        )


class QueueDecides(ClientError):
    """A job in a queue is suspended and resumed by Kueue alone."""

    @classmethod
    def of(cls, name: str, namespace: str, queue: str) -> Self:
        """Return the error about a job in this queue."""
        return cls(
            f"job {name}: Kueue decides when it runs, since it is in the queue {queue}; to stop it, delete "
            "it, or set spec.active of its Workloads to false "
            f"(`kubectl get workloads -n {namespace}` lists them)"
        )


class EndedOtherwise(ClientError):
    """The job ended, and not as it was waited for."""


class TookTooLong(ClientError, TimeoutError):
    """A deadline passed; the same call may be made again."""


class NoPod(ClientError, LookupError):
    """A replica has no pod, or no such container, whose log could be read."""


class NotFetched(ClientError):
    """A run could not be copied; nothing was written."""
