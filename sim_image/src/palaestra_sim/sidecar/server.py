"""The routes of a sidecar's two ports.

The control port is for the trainer in the same pod. It has no authentication, so it listens on loopback only.
The module `simulator` decides whether the simulator's state allows a request. All clients that can reach the
pod can use the health port, so this port has only requests that read. Both ports have the routes for viewers
(`viewing`).
"""

from collections.abc import Callable, Sequence
from functools import partial
from http import HTTPStatus

from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest

from palaestra_protocol.control import STANDBY, PlainRequest, ProtocolError, StopRequest, decoded
from palaestra_protocol.http import (
    Address,
    Response,
    Route,
    Routes,
    Server,
    error_response,
    json_response,
    probe_response,
)
from palaestra_sim.errors import SidecarError
from palaestra_sim.sidecar.lifecycle import LifecycleEvent
from palaestra_sim.sidecar.simulator import CommandResult, NoAnswer, SupervisedSimulator
from palaestra_sim.sidecar.viewing import NothingToSee, SimulatorSilent

_ABOVE = ("", STANDBY)  # path prefixes of the first simulator and of its standby


def bound(option: str, address: Address, routes: Routes) -> Server:
    """Return a server for these routes, not yet started.

    Args:
        option: the command-line option that set the address, for messages.
        address: the address on which the server listens.
        routes: the function for each method and path.

    Raises:
        SidecarError: the address is in use, or does not belong to this machine.
    """
    try:
        return Server(address, routes, name="palaestra-sidecar")
    except OSError as error:
        remedy = "choose another port, or 0 for a free port"
        raise SidecarError(f"{option}: {address}: {error.strerror}; {remedy}") from error


def control_routes(simulators: Sequence[SupervisedSimulator]) -> Routes:
    """Return the routes of the control port; see `palaestra_protocol.control`."""
    routes: dict[tuple[str, str], Route] = {}
    for above, simulator in zip(_ABOVE, simulators, strict=False):
        routes |= {
            ("GET", f"{above}/state"): _state(simulator),
            ("POST", f"{above}/start"): _plain(simulator, LifecycleEvent.START),
            ("POST", f"{above}/ready"): _plain(simulator, LifecycleEvent.READY),
            ("POST", f"{above}/stop"): _stop(simulator),
        }
    return routes | _view_routes(simulators)


def health_routes(simulators: Sequence[SupervisedSimulator], registry: CollectorRegistry) -> Routes:
    """Return the routes of the health port: health, states and metrics."""
    states = {
        ("GET", f"{above}/state"): _state(simulator)
        for above, simulator in zip(_ABOVE, simulators, strict=False)
    }
    return (
        states
        | _view_routes(simulators)
        | {
            ("GET", "/healthz"): lambda _: probe_response(),
            ("GET", "/metrics"): lambda _: Response(
                status=HTTPStatus.OK, body=generate_latest(registry), content_type=CONTENT_TYPE_LATEST
            ),
        }
    )


def _view_routes(simulators: Sequence[SupervisedSimulator]) -> dict[tuple[str, str], Route]:
    routes: dict[tuple[str, str], Route] = {}
    for above, simulator in zip(_ABOVE, simulators, strict=False):
        routes[("GET", f"{above}/scene")] = partial(_viewed, simulator.viewing.scene)
        routes[("GET", f"{above}/watch")] = partial(_viewed, simulator.viewing.state)
        routes[("GET", f"{above}/camera")] = partial(_viewed, simulator.viewing.camera)
    return routes


def _viewed(read: Callable[[], bytes], _: bytes) -> Response:
    """Return a response with the data that `read` returns, or an error response with the reason."""
    try:
        return Response(status=HTTPStatus.OK, body=read(), content_type="application/json")
    except NothingToSee as error:
        return error_response(HTTPStatus.NOT_FOUND, str(error))
    except SimulatorSilent as error:
        return error_response(HTTPStatus.SERVICE_UNAVAILABLE, str(error))


def _state(simulator: SupervisedSimulator) -> Route:
    """Return the route that returns a simulator's state."""
    return lambda _: json_response(HTTPStatus.OK, simulator.as_answered().to_json())


def _plain(simulator: SupervisedSimulator, event: LifecycleEvent) -> Route:
    """Return the route of a request without parameters."""

    def route(body: bytes) -> Response:
        try:
            PlainRequest.from_json(decoded(body or b"{}"))
        except ProtocolError as error:
            return error_response(HTTPStatus.BAD_REQUEST, str(error))
        return _asked(lambda: simulator.ask(event))

    return route


def _stop(simulator: SupervisedSimulator) -> Route:
    """Return the route of a stop request."""

    def route(body: bytes) -> Response:
        try:
            request = StopRequest.from_json(decoded(body))
        except ProtocolError as error:
            return error_response(HTTPStatus.BAD_REQUEST, str(error))
        return _asked(lambda: simulator.ask(LifecycleEvent.STOP, request.deadline_s))

    return route


def _asked(ask: Callable[[], CommandResult]) -> Response:
    """Return the response for a request that `ask` sends to the owner of the simulator's state."""
    try:
        answer = ask()
    except NoAnswer as error:
        return error_response(HTTPStatus.SERVICE_UNAVAILABLE, str(error))
    return json_response(HTTPStatus.OK if answer.allowed else HTTPStatus.CONFLICT, answer.state.to_json())
