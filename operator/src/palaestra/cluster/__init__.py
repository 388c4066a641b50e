"""The only package that connects to an API server.

Requests and answers are plain JSON. The official client merges the files of a kubeconfig; its models are
not used (docs/decisions/0004). These modules know Kubernetes and no TrainingJob:

- `resources`: the kinds of objects and their addresses
- `connection`: the API server and the identity to use; `client_config`: its address and credentials
- `kubeconfig`, `service_account`: where they come from, outside a pod and in one
- `identity`, `plugin`, `tokens`, `impersonation`: who asks, and for whom
- `proxies`, `connection_pool`, `tls`: the way to the server, and whether it is the right one
- `timeouts`: deadlines, and waits before the next attempt
- `api`: one request, with a deadline
- `transport`: the bytes of a request
- `errors`: one error for each refusal
- `watch`: one watch, until it ends
- `reflector`: a cache that follows the API server
- `store`: the objects of that cache
- `workqueue`: work for the controller, one worker a key
- `lease`: leader election; `lease_timing`: its arithmetic
- `recorder`: events for people
- `pod_logs`: the log of a running container
- `pod_exec`: a command in a container
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
    Untrusted,
)
from palaestra.cluster.lease import Leadership
from palaestra.cluster.recorder import Recorder
from palaestra.cluster.reflector import Reflector
from palaestra.cluster.resources import Resource
from palaestra.cluster.store import Store
from palaestra.cluster.timeouts import Timeouts
from palaestra.cluster.workqueue import WorkQueue

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
    "NamespaceTerminating",
    "NoSuchKind",
    "NotConfigured",
    "NotFound",
    "Recorder",
    "Reflector",
    "Resource",
    "ServerError",
    "Store",
    "Timeouts",
    "TooManyRequests",
    "Unreachable",
    "Untrusted",
    "WorkQueue",
    "connect",
    "namespace_of",
    "own_namespace",
]
