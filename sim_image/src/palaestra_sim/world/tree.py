"""A world or PROTO file as nodes, fields and values.

The modules `reader` and `proto` parse the grammars of `.wbt` and `.proto`, without knowledge of node types.
Other modules define the fields of a Robot or a PROTO, and find the `DEF` of a `USE`. Every node and value has
the span of its bytes.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import TypeAlias

from palaestra_sim.world.tokens import Token, Tokens

Item: TypeAlias = "float | bool | str | Node | Is | None"


@dataclass(frozen=True, slots=True, kw_only=True)
class Is:
    """The value `IS name` of a field in the body of a PROTO: the value of the PROTO's field `name`."""

    name: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Value:
    """The value of a field: numbers, booleans, strings, nodes, `None` for NULL; in source order.

    `translation 0 0 1` has three items and is not bracketed. `translation IS place`, which occurs only in the
    body of a PROTO, has one item. The span is (start, end) in bytes, brackets included.
    """

    items: tuple[Item, ...]
    bracketed: bool
    span: tuple[int, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Node:
    """One node: `DEF def_name type_name { fields }`, or `USE uses` (then `type_name` is "").

    A saved state, `hidden position_0_0 1`, is the field "hidden position_0_0".
    The span is (start, end) in bytes, from `DEF` or the type to the closing brace.
    """

    type_name: str
    def_name: str | None
    uses: str | None
    fields: dict[str, Value]
    span: tuple[int, int]

    def numbers(self, name: str) -> tuple[float, ...] | None:
        """Return the numbers of a field; None if it is absent or has another value."""
        value = self.fields.get(name)
        if value is None:
            return None
        numbers = tuple(item for item in value.items if isinstance(item, float))
        return numbers if len(numbers) == len(value.items) else None

    def text(self, name: str) -> str | None:
        """Return the first string of a field, unescaped; None if the field has no string."""
        return next(iter(self.texts(name)), None)

    def texts(self, name: str) -> tuple[str, ...]:
        """Return the strings of a field, unescaped; () if it is absent."""
        return tuple(item for item in self._items(name) if isinstance(item, str))

    def flag(self, name: str, default: bool) -> bool:  # noqa: FBT001 - reads as in the world
        """Return the TRUE or FALSE of a field, or `default` if the field has neither."""
        return next((item for item in self._items(name) if isinstance(item, bool)), default)

    def nodes(self, name: str) -> tuple["Node", ...]:
        """Return the nodes of a field, including each `USE`; () if it is absent."""
        return tuple(item for item in self._items(name) if isinstance(item, Node))

    def _items(self, name: str) -> tuple[Item, ...]:
        value = self.fields.get(name)
        return () if value is None else value.items


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """A parsed world file: its bytes, its first line, and its nodes in source order.

    `externs` are the string tokens of its EXTERNPROTO lines; the last token in `tokens` is of kind `end`.
    """

    source: bytes
    header: str
    nodes: tuple[Node, ...]
    externs: tuple[Token, ...] = field(repr=False)
    tokens: Tokens = field(repr=False, compare=False)

    def walk(self) -> Iterator[Node]:
        """Yield every node, parents before children, in source order."""
        return walk(self.nodes)

    def inside(self, value: Value) -> Iterator[Token]:
        """Yield the tokens of a value of this world, including its brackets."""
        start, end = value.span
        first = self.index(start)
        return map(self.tokens.__getitem__, range(first, self.tokens.index_at(end, first)))

    def index(self, offset: int) -> int:
        """Return the index of the token at byte `offset`, or of the next token."""
        return self.tokens.index_at(offset)


def walk(nodes: Sequence[Node]) -> Iterator[Node]:
    """Yield these nodes and all nodes inside them, parents before children, in source order."""
    waiting = list(reversed(nodes))
    while waiting:
        node = waiting.pop()
        yield node
        inside = [item for value in node.fields.values() for item in value.items if isinstance(item, Node)]
        waiting.extend(reversed(inside))
