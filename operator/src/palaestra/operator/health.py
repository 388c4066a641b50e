"""The operator's HTTP server: liveness, readiness and metrics.

The server has no authentication: any client that reaches the pod may send requests. So the server is
read-only.
"""

from collections.abc import Callable
from http import HTTPStatus

from prometheus_client import CONTENT_TYPE_LATEST

from palaestra.errors import PalaestraError
from palaestra_protocol.http import Address, Response, Server, probe_response

Trouble = Callable[[], str | None]  # returns the problem in a sentence, or None


def serving(address: Address, *, healthy: Trouble, ready: Trouble, metrics: Callable[[], bytes]) -> Server:
    """Start and return a server for /healthz, /readyz and /metrics.

    Args:
        address: the address to listen on; port 0 selects a free port.
        healthy: returns a sentence about a problem that only a restart solves, or None.
        ready: returns a sentence about the lists that were not read yet, or None.
        metrics: returns the text of the metrics.

    Raises:
        PalaestraError: the server cannot listen on the address.
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
        raise PalaestraError(
            f"--metrics-address: {address}: {error.strerror}; choose a free address"
        ) from error
    server.start()
    return server
