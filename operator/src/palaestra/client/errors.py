"""What a client of a cluster can be told instead of what it asked for.

ClientError
├── NoSuchJob           there is no such TrainingJob, or it was deleted meanwhile
├── EndedOtherwise      the job ended, and not as it was waited for
├── TookTooLong         a deadline passed; the same call may be made again
├── NoPod               a replica has no pod whose log could be read
└── NotFetched          a run could not be copied; nothing was written

What the API server itself refuses is an ApiError (palaestra.cluster.errors).
"""

from palaestra.errors import PalaestraError


class ClientError(PalaestraError):
    """A cluster does not have, or do, what it was asked for."""


class NoSuchJob(ClientError, LookupError):
    """There is no such TrainingJob, or it was deleted meanwhile."""


class EndedOtherwise(ClientError):
    """The job ended, and not as it was waited for."""


class TookTooLong(ClientError, TimeoutError):
    """A deadline passed; the same call may be made again."""


class NoPod(ClientError, LookupError):
    """A replica has no pod whose log could be read."""


class NotFetched(ClientError):
    """A run could not be copied; nothing was written."""
