"""The operator's HTTP server: liveness, readiness and metrics.

Every client that reaches the pod may send requests, so they only read.
"""

from collections.abc import Callable
from http import HTTPStatus

from prometheus_client import CONTENT_TYPE_LATEST

from palaestra.errors import PalaestraError
from palaestra_protocol.http import Address, Response, Server, probe_response

Trouble = Callable[[], str | None]  # returns the problem in a sentence; None: there is none


def serving(address: Address, *, healthy: Trouble, ready: Trouble, metrics: Callable[[], bytes]) -> Server:
    """Return a server that answers /healthz, /readyz and /metrics from now on.

    Args:
        address: where to listen; port 0 takes a free one.
        healthy: returns a problem that only a restart solves.
        ready: returns what the operator still waits for.
        metrics: returns the text of the metrics.

    Raises:
        PalaestraError: the address cannot be listened on.
    """
    routes = {
        ("GET", "/healthz"): lambda _: probe_response(healthy()),
        ("GET", "/readyz"): lambda _: probe_response(ready()),
        ("GET", "/metrics"): lambda _: Response(
            status=HTTPStatus.OK, body=metrics(), content_type=CONTENT_TYPE_LATEST
        ),
    }
    try:
        server = Server(address, routes, name="palaestra-operator")
    except OSError as error:
        raise PalaestraError(f"--metrics-address: {address}: {error.strerror}; choose a free one") from error
    server.start()
    return server
