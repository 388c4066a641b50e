"""The only package that connects to an API server.

Requests and responses are plain JSON. The official client only merges the files of a kubeconfig; its models
are not used (docs/decisions/0004). These modules depend on Kubernetes, but not on TrainingJobs:

- `resources`: the kinds of objects and their API paths
- `connection`: the choice of API server and identity; `client_config`: address and credentials of the server
- `kubeconfig`, `service_account`: the sources of address and credentials, outside a pod and in a pod
- `identity`, `plugin`, `tokens`, `impersonation`: the user who sends requests, and the impersonated user
- `proxies`, `connection_pool`, `tls`: the route to the server, and the verification of its certificate
- `timeouts`: deadlines, and waits before a retry
- `api`: one request, with a deadline
- `transport`: the bytes of requests and responses
- `errors`: the exceptions, one for each kind of refusal
- `watch`: one watch, until it ends
- `reflector`: a cache that follows the API server
- `store`: the objects in such a cache
- `workqueue`: the keys to reconcile; two workers never have the same key at the same time
- `lease`: leader election; `lease_timing`: the arithmetic of its durations
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
