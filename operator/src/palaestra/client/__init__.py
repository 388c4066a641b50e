"""TrainingJobs of a cluster, from Python.

    from palaestra import Client

    with Client() as client:
        client.apply(Path("job.yaml"))
        job = client.wait("job", deadline_s=3600)

`client` has the public class. `errors` has the exceptions, and converts responses of the API server to them.
`watch` waits for changes, `wait_progress` describes changes as lines, and `events` reads events. `fetch`
copies a run out of its volume: the pod of `volume_reader_pod` runs `tar_stream`, and `tar_extraction` unpacks
the output.
"""

from palaestra.client.client import Client
from palaestra.client.errors import (
    ClientError,
    EndedOtherwise,
    HasEnded,
    NoPod,
    NoSuchJob,
    NoSuchNamespace,
    NotFetched,
    NothingLost,
    NotInstalled,
    QueueDecides,
    TookTooLong,
    asked,
    check_namespace,
)
from palaestra.client.events import Event
from palaestra.client.wait_progress import why

__all__ = [
    "Client",
    "ClientError",
    "EndedOtherwise",
    "Event",
    "HasEnded",
    "NoPod",
    "NoSuchJob",
    "NoSuchNamespace",
    "NotFetched",
    "NotInstalled",
    "NothingLost",
    "QueueDecides",
    "TookTooLong",
    "asked",
    "check_namespace",
    "why",
]
