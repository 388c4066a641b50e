"""The methods of the Master API and the Parameter Server API, and the updates that they cause.

A call only changes registrations and parameters, and returns the response and the updates. The module
`updates` sends the updates. Make only one call at a time. Source: http://wiki.ros.org/ROS/Master_API and
http://wiki.ros.org/ROS/Parameter%20Server%20API
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from typing import Any, NamedTuple

from palaestra_protocol.xmlrpc.documents import MOST_DEPTH
from palaestra_protocol.xmlrpc.responses import FAILED, OK, WRONG, RpcResponse
from palaestra_trainer.ros_master.arguments import (
    WrongArgument,
    name_of,
    text_of,
    topic_or_service,
    type_name_of,
    uri_of,
)
from palaestra_trainer.ros_master.names import parts, resolved
from palaestra_trainer.ros_master.parameters import Parameters, as_subscribed, changes
from palaestra_trainer.ros_master.registrations import Kind, Registrations

MASTER = "/master"  # the caller's name when the master calls nodes
_REPLACED = "new node registered with same name"  # the message of rosmaster, because people search for it


class Update(NamedTuple):
    """A call that the master makes to a node.

    Attributes:
        uri: the URI of the node.
        method: the method of the Slave API.
        subject: the topic, parameter or node that changed; a newer update of the same method and subject
            replaces an older update.
        value: the new value, or the reason of a shutdown.
        node: full name of the node.
    """

    uri: str
    method: str
    subject: str
    value: Any
    node: str = ""


class _Call:
    """A method of the API: its function, and the value in the response if its arguments are wrong."""

    def __init__(self, function: Callable[..., RpcResponse], nothing: Any) -> None:
        self.nothing = nothing
        self._function = function
        self._names = tuple(inspect.signature(function).parameters)

    def respond(self, arguments: tuple[Any, ...]) -> RpcResponse:
        """Check the arguments, call the function and return its response.

        Raises:
            WrongArgument: there are too few or too many arguments, or an argument is wrong.
        """
        if len(arguments) != len(self._names):
            names = ", ".join(name.removeprefix("_") for name in self._names)
            raise WrongArgument(f"{len(arguments)} arguments were given; the method takes {names}")
        if not isinstance(arguments[0], str):
            raise WrongArgument(f"caller: {arguments[0]!r} is not a text; give the full name of the node")
        return self._function(*arguments)


class MasterApi:
    """The methods of the master, by their names in XML-RPC.

    Args:
        uri: URI at which the master responds.
        pid: the process ID of the master's process.
    """

    def __init__(self, uri: str, pid: int) -> None:
        self._uri = uri
        self._pid = pid
        self._nodes = Registrations()
        self._parameters = Parameters()
        self._updates: list[Update] = []
        self._calls = {
            name: _Call(getattr(self, function), nothing) for name, (function, nothing) in _CALLS.items()
        }

    def knows(self, method: str) -> bool:
        """Return whether the master has this method."""
        return method in self._calls

    def call(self, method: str, arguments: tuple[Any, ...]) -> tuple[RpcResponse, list[Update]]:
        """Return the response to a call, and the updates to send, in their order.

        Raises:
            KeyError: the master does not have this method.
        """
        made = self._calls[method]
        self._updates = []
        try:
            response = made.respond(arguments)
        except WrongArgument as error:
            response = RpcResponse(WRONG, f"{method}: {error}", made.nothing)
        return response, self._updates

    def stop_updates(self, update: Update) -> None:
        """Unsubscribe a node that refused an update of a parameter."""
        self._nodes.unregister(Kind.PARAMETER, update.subject, update.node, update.uri)

    def _get_uri(self, _caller: str) -> RpcResponse:
        return RpcResponse(OK, "the URI of this master", self._uri)

    def _get_pid(self, _caller: str) -> RpcResponse:
        return RpcResponse(OK, "the process of this master", self._pid)

    def _register_service(self, caller: str, service: Any, service_api: Any, caller_api: Any) -> RpcResponse:
        name = topic_or_service("service", service, caller)
        address, uri = uri_of("service_api", service_api), uri_of("caller_api", caller_api)
        self._shut_down(caller, self._nodes.register_service(name, caller, uri, address))
        return RpcResponse(OK, f"{caller} serves {name}", 1)

    def _unregister_service(self, caller: str, service: Any, service_api: Any) -> RpcResponse:
        name = topic_or_service("service", service, caller)
        address = uri_of("service_api", service_api)
        return _removed(caller, name, removed=self._nodes.unregister_service(name, caller, address))

    def _lookup_service(self, caller: str, service: Any) -> RpcResponse:
        name = topic_or_service("service", service, caller)
        address = self._nodes.address_of(name)
        if address is None:
            return RpcResponse(WRONG, f"no node serves {name}", "")
        return RpcResponse(OK, f"{name} is served", address)

    def _register_subscriber(self, caller: str, topic: Any, topic_type: Any, caller_api: Any) -> RpcResponse:
        name, type_name = topic_or_service("topic", topic, caller), type_name_of("topic_type", topic_type)
        uri = uri_of("caller_api", caller_api)
        self._shut_down(caller, self._nodes.register(Kind.SUBSCRIBER, name, caller, uri))
        self._nodes.declare_type(name, type_name, published=False)
        return RpcResponse(OK, f"{caller} subscribes to {name}", self._nodes.uris(Kind.PUBLISHER, name))

    def _unregister_subscriber(self, caller: str, topic: Any, caller_api: Any) -> RpcResponse:
        name, uri = topic_or_service("topic", topic, caller), uri_of("caller_api", caller_api)
        return _removed(caller, name, removed=self._nodes.unregister(Kind.SUBSCRIBER, name, caller, uri))

    def _register_publisher(self, caller: str, topic: Any, topic_type: Any, caller_api: Any) -> RpcResponse:
        name, type_name = topic_or_service("topic", topic, caller), type_name_of("topic_type", topic_type)
        uri = uri_of("caller_api", caller_api)
        self._shut_down(caller, self._nodes.register(Kind.PUBLISHER, name, caller, uri))
        self._nodes.declare_type(name, type_name, published=True)
        self._announce(name)
        return RpcResponse(OK, f"{caller} publishes {name}", self._nodes.uris(Kind.SUBSCRIBER, name))

    def _unregister_publisher(self, caller: str, topic: Any, caller_api: Any) -> RpcResponse:
        name, uri = topic_or_service("topic", topic, caller), uri_of("caller_api", caller_api)
        removed = self._nodes.unregister(Kind.PUBLISHER, name, caller, uri)
        if removed:
            self._announce(name)
        return _removed(caller, name, removed=removed)

    def _lookup_node(self, caller: str, node: Any) -> RpcResponse:
        name = name_of("node", node, caller)
        uri = self._nodes.uri_of(name)
        if uri is None:
            return RpcResponse(WRONG, f"no node {name} is registered", "")
        return RpcResponse(OK, f"{name} is registered", uri)

    def _get_published_topics(self, caller: str, subgraph: Any) -> RpcResponse:
        if not isinstance(subgraph, str):
            raise WrongArgument(f"subgraph: {subgraph!r} is not a text; give a namespace, or an empty text")
        namespace = as_subscribed(resolved(subgraph, caller)) if subgraph else ""
        names = (name for name in self._nodes.names(Kind.PUBLISHER) if name.startswith(namespace))
        return RpcResponse(
            OK, "topics with publishers", [(name, self._nodes.type_of(name)) for name in names]
        )

    def _get_topic_types(self, _caller: str) -> RpcResponse:
        return RpcResponse(OK, "topics and their types", self._nodes.types())

    def _get_system_state(self, _caller: str) -> RpcResponse:
        kinds = (Kind.PUBLISHER, Kind.SUBSCRIBER, Kind.SERVICE)
        return RpcResponse(
            OK, "publishers, subscribers, services", [self._nodes.listed(kind) for kind in kinds]
        )

    def _delete_param(self, caller: str, key: Any) -> RpcResponse:
        name = resolved(text_of("key", key), caller)
        try:
            self._parameters.delete(name)
        except KeyError:
            return RpcResponse(WRONG, f"{name} is not set", 0)
        self._report_changes(name, {}, but=None)
        return RpcResponse(OK, f"{name} is deleted", 0)

    def _set_param(self, caller: str, key: Any, value: Any) -> RpcResponse:
        name = resolved(text_of("key", key), caller)
        if len(parts(name)) > MOST_DEPTH:
            raise WrongArgument(f"key: has more than {MOST_DEPTH} parts; use a shorter name")
        if value is None:
            raise WrongArgument("value: is missing; to delete a parameter, call deleteParam")
        try:
            self._parameters.set(name, value)
        except TypeError as error:
            raise WrongArgument(f"value: {error}") from error
        self._report_changes(name, value, but=caller)
        return RpcResponse(OK, f"{name} is set", 0)

    def _get_param(self, caller: str, key: Any) -> RpcResponse:
        name = resolved(text_of("key", key), caller)
        try:
            return RpcResponse(OK, f"{name} is set", self._parameters.get(name))
        except KeyError:
            return RpcResponse(WRONG, f"{name} is not set", 0)

    def _search_param(self, caller: str, key: Any) -> RpcResponse:
        wanted = text_of("key", key)
        try:
            found = self._parameters.search(wanted, caller)
        except ValueError as error:
            return RpcResponse(FAILED, str(error), 0)
        if found is None:
            return RpcResponse(WRONG, f"{wanted} is not set at {caller} or above", "")
        return RpcResponse(OK, f"{wanted} is {found}", found)

    def _subscribe_param(self, caller: str, caller_api: Any, key: Any) -> RpcResponse:
        uri, name = uri_of("caller_api", caller_api), resolved(text_of("key", key), caller)
        value = self._parameters.get(name) if self._parameters.has(name) else {}
        self._shut_down(caller, self._nodes.register(Kind.PARAMETER, as_subscribed(name), caller, uri))
        return RpcResponse(OK, f"{caller} subscribes to {name}", value)

    def _unsubscribe_param(self, caller: str, caller_api: Any, key: Any) -> RpcResponse:
        uri, name = uri_of("caller_api", caller_api), resolved(text_of("key", key), caller)
        self._nodes.unregister(Kind.PARAMETER, as_subscribed(name), caller, uri)
        return RpcResponse(OK, f"{caller} does not subscribe to {name}", 1)

    def _has_param(self, caller: str, key: Any) -> RpcResponse:
        name = resolved(text_of("key", key), caller)
        return RpcResponse(OK, name, self._parameters.has(name))

    def _get_param_names(self, _caller: str) -> RpcResponse:
        return RpcResponse(OK, "names of all parameters", self._parameters.names())

    def _shut_down(self, node: str, uri: str | None) -> None:
        if uri is not None:
            self._updates.append(Update(uri, "shutdown", node, f"[{node}] Reason: {_REPLACED}", node))

    def _announce(self, topic: str) -> None:
        publishers = self._nodes.uris(Kind.PUBLISHER, topic)
        for node, uri in self._nodes.members(Kind.SUBSCRIBER, topic):
            self._updates.append(Update(uri, "publisherUpdate", topic, publishers, node))

    def _report_changes(self, name: str, value: Any, *, but: str | None) -> None:
        """Add an update for each subscriber.

        The node `but` made the change. It gets no update of a change at or below the name to which it
        subscribes.
        """
        for change in changes(name, value, self._nodes.names(Kind.PARAMETER)):
            for node, uri in self._nodes.members(Kind.PARAMETER, change.subscribed):
                if not (change.by_caller and node == but):
                    self._updates.append(Update(uri, "paramUpdate", change.name, change.value, node))


def _removed(node: str, name: str, *, removed: bool) -> RpcResponse:
    if removed:
        return RpcResponse(OK, f"{node} is not registered for {name} any more", 1)
    return RpcResponse(OK, f"{node} was not registered for {name} at this address", 0)


# For each method name in XML-RPC: the Python method, and the value in the response if the arguments are
# wrong.
_CALLS: dict[str, tuple[str, Any]] = {
    "getUri": ("_get_uri", ""),
    "getPid": ("_get_pid", -1),
    "registerService": ("_register_service", 0),
    "unregisterService": ("_unregister_service", 0),
    "lookupService": ("_lookup_service", ""),
    "registerSubscriber": ("_register_subscriber", []),
    "unregisterSubscriber": ("_unregister_subscriber", 0),
    "registerPublisher": ("_register_publisher", []),
    "unregisterPublisher": ("_unregister_publisher", 0),
    "lookupNode": ("_lookup_node", ""),
    "getPublishedTopics": ("_get_published_topics", 0),
    "getTopicTypes": ("_get_topic_types", []),
    "getSystemState": ("_get_system_state", [[], [], []]),
    "deleteParam": ("_delete_param", 0),
    "setParam": ("_set_param", 0),
    "getParam": ("_get_param", 0),
    "searchParam": ("_search_param", 0),
    "subscribeParam": ("_subscribe_param", 0),
    "unsubscribeParam": ("_unsubscribe_param", 0),
    "hasParam": ("_has_param", False),
    "getParamNames": ("_get_param_names", []),
}
