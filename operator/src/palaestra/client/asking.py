"""What it means that the API server found nothing: no such job, no namespace, or no TrainingJobs at all."""

from collections.abc import Iterator
from contextlib import contextmanager

from palaestra.client.errors import NoSuchJob, NoSuchNamespace, NotInstalled
from palaestra.cluster import Api, Forbidden, NoSuchKind, NotFound
from palaestra.cluster.resources import NAMESPACES


@contextmanager
def asked(name: str | None, namespace: str) -> Iterator[None]:
    """Run requests about TrainingJobs; `name` is that of one job, None where no one job is meant.

    Raises:
        NotInstalled: the cluster does not know TrainingJobs.
        NoSuchJob: there is none of that name.
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
    """Ask whether a namespace exists; without the right to ask, it is taken to exist.

    Raises:
        NoSuchNamespace: it does not.
    """
    try:
        api.get(NAMESPACES, None, name)
    except Forbidden:
        return
    except NotFound as error:
        raise NoSuchNamespace.of(name) from error
