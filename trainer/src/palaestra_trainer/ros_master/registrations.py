"""Keep the registrations of nodes: their topics, services and addresses.

This module is pure: it uses no thread, socket or clock. A node is known from its first registration until its
last registration ends. If a node registers with another address, it counts as a new node of the same name,
and all registrations of the old node are dropped.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum, auto

ANY_TYPE = "*"


class Kind(Enum):
    """The role in which a node registers."""

    PUBLISHER = auto()
    SUBSCRIBER = auto()
    SERVICE = auto()
    PARAMETER = auto()


@dataclass(slots=True)
class _Node:
    """A node: the URI at which it responds, and its registrations."""

    uri: str
    registered: set[tuple[Kind, str]] = field(default_factory=set)


class Registrations:
    """All registrations of one master, by the names of topics, services and parameters.

    Every name is global. All results are in the order of registration.
    """

    def __init__(self) -> None:
        self._nodes: dict[str, _Node] = {}
        # URIs of nodes, by the kind of registration, the name of the topic, service or parameter, and the
        # node's name.
        self._members: dict[Kind, dict[str, dict[str, str]]] = {kind: {} for kind in Kind}
        self._service_uris: dict[str, tuple[str, str]] = {}  # the node and address of each service
        self._types: dict[str, str] = {}

    def register(self, kind: Kind, name: str, node: str, uri: str) -> str | None:
        """Register a node; return the URI of an older node of the same name, or None.

        Args:
            kind: any kind except SERVICE; use `register_service` for services.
            name: the name of the topic or parameter.
            node: full name of the node.
            uri: URI at which the node responds.
        """
        replaced = self._entered(kind, name, node, uri)
        self._members[kind].setdefault(name, {})[node] = uri
        return replaced

    def register_service(self, service: str, node: str, uri: str, address: str) -> str | None:
        """Register the only node that serves `service`; return the same value as `register`."""
        replaced = self._entered(Kind.SERVICE, service, node, uri)
        owner, _ = self._service_uris.get(service, (node, ""))
        if owner != node:
            self._left(Kind.SERVICE, service, owner)
        self._members[Kind.SERVICE][service] = {node: uri}
        self._service_uris[service] = (node, address)
        return replaced

    def unregister(self, kind: Kind, name: str, node: str, uri: str) -> bool:
        """Remove a registration; return whether that node had this registration.

        Args:
            kind: any kind except SERVICE; use `unregister_service` for services.
            name: the name of the topic or parameter.
            node: full name of the node.
            uri: URI at which the node responds; a registration with another URI stays.
        """
        members = self._members[kind].get(name, {})
        if members.get(node) != uri:
            return False
        del members[node]
        if not members:
            del self._members[kind][name]
        self._left(kind, name, node)
        return True

    def unregister_service(self, service: str, node: str, address: str) -> bool:
        """Remove the registration of a service; return whether that node served it at that address."""
        if node not in self._nodes or self._service_uris.get(service) != (node, address):
            return False
        del self._service_uris[service]
        del self._members[Kind.SERVICE][service]
        self._left(Kind.SERVICE, service, node)
        return True

    def knows(self, node: str) -> bool:
        """Return whether a node of that name has a registration."""
        return node in self._nodes

    def uri_of(self, node: str) -> str | None:
        """Return the URI of a node; None if it has no registration."""
        found = self._nodes.get(node)
        return None if found is None else found.uri

    def address_of(self, service: str) -> str | None:
        """Return the address of a service; None if no node serves it."""
        found = self._service_uris.get(service)
        return None if found is None else found[1]

    def members(self, kind: Kind, name: str) -> list[tuple[str, str]]:
        """Return name and URI of each node that is registered for `name`."""
        return list(self._members[kind].get(name, {}).items())

    def uris(self, kind: Kind, name: str) -> list[str]:
        """Return the URI of each node that is registered for `name`."""
        return list(self._members[kind].get(name, {}).values())

    def names(self, kind: Kind) -> list[str]:
        """Return the topics, services or parameters for which a node is registered."""
        return list(self._members[kind])

    def listed(self, kind: Kind) -> list[tuple[str, list[str]]]:
        """Return each topic, service or parameter with the names of its nodes."""
        return [(name, list(members)) for name, members in self._members[kind].items()]

    def type_of(self, topic: str) -> str:
        """Return the type of a topic that a node publishes.

        Raises:
            KeyError: no node has ever registered for the topic with a type.
        """
        return self._types[topic]

    def types(self) -> list[tuple[str, str]]:
        """Return each topic that ever had a type, with that type."""
        return list(self._types.items())

    def declare_type(self, topic: str, type_name: str, *, published: bool) -> None:
        """Set the type of a topic to that of its newest publisher, or else of its first subscriber.

        ANY_TYPE does not replace another type, and only a publisher can declare it.
        """
        absent = topic not in self._types
        if (published and (absent or type_name != ANY_TYPE)) or (absent and type_name != ANY_TYPE):
            self._types[topic] = type_name

    def _entered(self, kind: Kind, name: str, node: str, uri: str) -> str | None:
        """Record a registration; drop an older node of the same name, and return its URI."""
        known = self._nodes.get(node)
        if known is not None and known.uri == uri:
            known.registered.add((kind, name))
            return None
        if known is not None:
            self._drop(node)
        self._nodes[node] = _Node(uri, {(kind, name)})
        return None if known is None else known.uri

    def _left(self, kind: Kind, name: str, node: str) -> None:
        known = self._nodes[node]
        known.registered.discard((kind, name))
        if not known.registered:
            del self._nodes[node]

    def _drop(self, node: str) -> None:
        for members_of in self._members.values():
            for name in [name for name, members in members_of.items() if node in members]:
                del members_of[name][node]
                if not members_of[name]:
                    del members_of[name]
        for service in [name for name, (owner, _) in self._service_uris.items() if owner == node]:
            del self._service_uris[service]
