"""The scope of a node: the file in which it is written, the `DEF`s of that file, and the values of `IS`.

`USE name` refers to the last `DEF` of that name before it, in the same file. In a PROTO, `IS name` refers to
a value of the instance; this value was written in another file. So a lookup returns a value with its scope.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from palaestra_sim.errors import WorldError
from palaestra_sim.world import Is, Node, Value
from palaestra_sim.world.source import Source
from palaestra_sim.world.tree import walk


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Scope:
    """One file, or one instance of a PROTO.

    Attributes:
        source: the bytes of the file.
        defs: the nodes of the file that have a DEF name, by this name, in the order of the file.
        bindings: for a PROTO, the value of each field, with the scope in which the value is written.
        depth: the number of PROTO instances that contain this scope.
    """

    source: Source
    defs: Mapping[str, list[Node]]
    bindings: Mapping[str, tuple[Value, Scope]] = field(default_factory=dict)
    depth: int = 0

    @classmethod
    def of(cls, source: Source, nodes: Iterable[Node]) -> Scope:
        """Return the scope of a file with these nodes at its top."""
        return cls(source=source, defs=definitions(nodes))

    def error(self, node: Node, fact: str, remedy: str) -> WorldError:
        """Return an error at the position of a node, for the caller to raise."""
        return self.source.error(node.span[0], fact, remedy)

    def resolve(self, node: Node) -> Node:
        """Return the node itself, or the node to which its `USE` refers.

        Raises:
            WorldError: no node with that DEF name precedes the `USE`.
        """
        if node.uses is None:
            return node
        named = self.defs.get(node.uses, [])
        before = bisect_right([found.span[0] for found in named], node.span[0])
        if before == 0:
            raise self.error(node, f"USE {node.uses} has no DEF before it", "define it first")
        return named[before - 1]

    def value(self, value: Value) -> tuple[Value, Scope] | None:
        """Return a value with the scope in which it is written; None for an `IS` of an unknown field."""
        if len(value.items) == 1 and isinstance(bound := value.items[0], Is):
            found = self.bindings.get(bound.name)
            return None if found is None else found[1].value(found[0])
        return value, self


def definitions(nodes: Iterable[Node]) -> dict[str, list[Node]]:
    """Return the nodes that have a DEF name, including nested nodes, by this name."""
    found: dict[str, list[Node]] = {}
    for node in walk(tuple(nodes)):
        if node.def_name is not None:
            found.setdefault(node.def_name, []).append(node)
    return found
