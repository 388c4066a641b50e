"""Errors for missing objects: a job, a namespace, or the TrainingJob definition."""

from collections.abc import Iterator
from contextlib import contextmanager

from palaestra.client.errors import NoSuchJob, NoSuchNamespace, NotInstalled
from palaestra.cluster import Api, Forbidden, NoSuchKind, NotFound
from palaestra.cluster.resources import NAMESPACES


@contextmanager
def asked(name: str | None, namespace: str) -> Iterator[None]:
    """Run requests about TrainingJobs; `name` is the name of one job, or None.

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
    """Check that a namespace exists; without permission to read it, it is assumed to exist.

    Raises:
        NoSuchNamespace: the namespace does not exist.
    """
    try:
        api.get(NAMESPACES, None, name)
    except Forbidden:
        return
    except NotFound as error:
        raise NoSuchNamespace.of(name) from error
