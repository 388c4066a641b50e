"""The only place that talks to an API server.

Requests and answers are plain JSON; the official client gives configuration, credentials and TLS, no models
(docs/decisions/0004). What is here knows Kubernetes and nothing of TrainingJobs:

    resources   the kinds of objects and their addresses        errors      what can be answered instead
    connection  which API server, and who we are                limits      how long anything may take
    api         one request, with a deadline                    transport   the bytes of it
    watching    one watch, until it ends                        reflector   a cache that follows it
    store       what the cache holds                            queue       work, one worker a key
    lease       who leads                                       recorder    events for people
    lines       a log that goes on                              executing   a command in a container
"""

from palaestra.cluster.api import Api
from palaestra.cluster.connection import connect, namespace_of, own_namespace
from palaestra.cluster.errors import (
    AlreadyExists,
    ApiError,
    CommandFailed,
    Conflict,
    Forbidden,
    Gone,
    Invalid,
    NamespaceTerminating,
    NoSuchKind,
    NotConfigured,
    NotFound,
    ServerError,
    TooManyRequests,
    Unreachable,
)
from palaestra.cluster.lease import Leadership
from palaestra.cluster.limits import Limits
from palaestra.cluster.queue import WorkQueue
from palaestra.cluster.recorder import Recorder
from palaestra.cluster.reflector import Reflector
from palaestra.cluster.resources import Resource
from palaestra.cluster.store import Store

__all__ = [
    "AlreadyExists",
    "Api",
    "ApiError",
    "CommandFailed",
    "Conflict",
    "Forbidden",
    "Gone",
    "Invalid",
    "Leadership",
    "Limits",
    "NamespaceTerminating",
    "NoSuchKind",
    "NotConfigured",
    "NotFound",
    "Recorder",
    "Reflector",
    "Resource",
    "ServerError",
    "Store",
    "TooManyRequests",
    "Unreachable",
    "WorkQueue",
    "connect",
    "namespace_of",
    "own_namespace",
]
