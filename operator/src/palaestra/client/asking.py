"""What it means that the API server found nothing: no such job, or no TrainingJobs at all in this cluster."""

from collections.abc import Iterator
from contextlib import contextmanager

from palaestra.client.errors import NoSuchJob, NotInstalled
from palaestra.cluster import NoSuchKind, NotFound


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
