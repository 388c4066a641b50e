"""Create a trainer's HTTP server for /status, /metrics, /healthz and /watch."""

from __future__ import annotations

import errno
from collections.abc import Mapping
from http import HTTPStatus
from types import MappingProxyType

from prometheus_client import generate_latest
from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4

from palaestra_protocol.http import Address, Response, Server, json_response, probe_response
from palaestra_protocol.metrics import Family, Values
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run.telemetry import metrics
from palaestra_trainer.run.telemetry.progress import Progress


def status_server(
    address: str, progress: Progress, known: Mapping[Family, Values] = MappingProxyType({})
) -> Server:
    """Return a server that is bound to the address; it responds after its start.

    Args:
        address: `host:port`; port 0 chooses a free port.
        progress: the progress of the run.
        known: metrics that do not change, see `metrics.constants`.

    Raises:
        ConfigurationError: the address is in use, or does not belong to this machine.
    """
    registry = metrics.registry(progress, known)
    routes = {
        ("GET", "/status"): lambda _: json_response(HTTPStatus.OK, progress.status().to_json()),
        ("GET", "/metrics"): lambda _: Response(
            status=HTTPStatus.OK, body=generate_latest(registry), content_type=CONTENT_TYPE_PLAIN_0_0_4
        ),
        ("GET", "/healthz"): lambda _: probe_response(),
        ("GET", "/watch"): lambda _: json_response(
            HTTPStatus.OK, {name: moment.to_json() for name, moment in progress.moments().items()}
        ),
    }
    host, _, port = address.rpartition(":")
    try:
        return Server(Address(host.strip("[]"), int(port)), routes, name="palaestra-trainer")
    except (OSError, OverflowError) as error:
        taken = isinstance(error, OSError) and error.errno == errno.EADDRINUSE
        fact = "is in use" if taken else f"cannot be listened on ({error})"
        raise ConfigurationError(
            f"statusAddress: {address} {fact}; choose another address or free it"
        ) from error
