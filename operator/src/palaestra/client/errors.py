"""The errors of a client of a cluster.

    ClientError
    ├── NotInstalled        the cluster has no TrainingJob definition
    ├── NoSuchNamespace     the namespace does not exist
    ├── NoSuchJob           the TrainingJob does not exist, or was deleted during the call
    ├── QueueDecides        only Kueue suspends and resumes a job in a queue
    ├── HasEnded            the job has ended, so it is not suspended, resumed or restarted
    ├── NothingLost         no replica of the job has lost its run, so no replica is restarted
    ├── EndedOtherwise      the job ended in another phase than expected
    ├── TookTooLong         a deadline passed; the same call may be repeated
    ├── NoPod               a replica has no pod or no such container, so it has no log
    └── NotFetched          a run could not be copied; no file was written

A request that the API server refuses raises an ApiError (palaestra.cluster.errors).
"""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Self

from palaestra.api.job import API_VERSION
from palaestra.cluster import Api, Forbidden, NoSuchKind, NotFound
from palaestra.cluster.resources import NAMESPACES
from palaestra.errors import PalaestraError

INSTALL = "`palaestra crd | kubectl apply --server-side -f -`"


class ClientError(PalaestraError):
    """A cluster does not have a requested object, or did not execute a request."""


class NotInstalled(ClientError):
    """The cluster has no TrainingJob definition; retrying cannot help."""

    def __init__(self) -> None:
        super().__init__(
            f"{API_VERSION}: the cluster has no TrainingJob definition; install it with {INSTALL}, or choose "
            "another cluster with --context; `palaestra doctor` shows what else is missing"
        )


class NoSuchNamespace(ClientError, LookupError):
    """The namespace does not exist."""

    @classmethod
    def of(cls, name: str) -> Self:
        """Return the error about a namespace of this name."""
        return cls(
            f"namespace {name}: does not exist; choose another with -n; `kubectl get namespaces` lists all"
        )


class NoSuchJob(ClientError, LookupError):
    """The TrainingJob does not exist, or was deleted during the call."""

    @classmethod
    def of(cls, name: str, namespace: str) -> Self:
        """Return the error about a job of this name."""
        return cls(
            f"job {name}: does not exist in namespace {namespace}; "
            "`palaestra get` lists the jobs of a namespace, `palaestra get -A` those of all namespaces"
        )


class QueueDecides(ClientError):
    """Only Kueue suspends and resumes a job in a queue."""

    @classmethod
    def of(cls, name: str, namespace: str, queue: str) -> Self:
        """Return the error about a job in this queue."""
        return cls(
            f"job {name}: Kueue decides when it runs, because it is in queue {queue}; to stop it, delete "
            "it, or set spec.active of its Workloads to false "
            f"(`kubectl get workloads -n {namespace}` lists the Workloads)"
        )


class HasEnded(ClientError):
    """The job has ended, so it is not suspended, resumed or restarted; retrying cannot help."""

    @classmethod
    def of(cls, name: str, phase: str, verb: str) -> Self:
        """Return the error about a job that ended in `phase`; `verb` is a participle, such as `resumed`."""
        return cls(
            f"job {name}: has ended ({phase}), so it cannot be {verb}; create a new job, and continue this "
            "run with spec.storage.resumeFrom"
        )


class NothingLost(ClientError):
    """No replica of the job has lost its run, so no replica can be restarted."""

    @classmethod
    def of(cls, name: str) -> Self:
        """Return the error about the job of this name."""
        return cls(
            f"job {name}: no replica has the reason RunLost, so no run is restarted; to train from step 0 "
            "again, create a new job"
        )


class EndedOtherwise(ClientError):
    """The job ended in another phase than expected."""


class TookTooLong(ClientError, TimeoutError):
    """A deadline passed; the same call may be repeated."""


class NoPod(ClientError, LookupError):
    """A replica has no pod or no such container, so it has no log."""


class NotFetched(ClientError):
    """A run could not be copied; no file was written."""


@contextmanager
def asked(name: str | None, namespace: str) -> Iterator[None]:
    """Replace errors of requests in the block; `name` is the requested job, None for several jobs.

    Raises:
        NotInstalled: the cluster has no TrainingJob definition.
        NoSuchJob: no job has this name.
    """
    try:
        yield
    except NoSuchKind as error:
        raise NotInstalled from error
    except NotFound as error:
        if name is None:
            raise
        raise NoSuchJob.of(name, namespace) from error


def check_namespace(api: Api, name: str) -> None:
    """Check that a namespace exists; without permission to read the namespace, do not check.

    Raises:
        NoSuchNamespace: the namespace does not exist.
    """
    try:
        api.get(NAMESPACES, None, name)
    except Forbidden:
        return
    except NotFound as error:
        raise NoSuchNamespace.of(name) from error
