"""Parse the tokens of a world file into its tree.

The parser is a recursive descent with one function for each rule of the grammar. `MAX_DEPTH` limits the
nesting, so that Python's stack cannot overflow. For any bytes the result is a World or a WorldError. The
rules for nodes apply to PROTO files too; the module `proto` has the other rules for PROTO files.
"""

import re
from sys import intern

from palaestra_sim.errors import WorldError
from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import Token, Tokens, glance, tokenize, unquoted
from palaestra_sim.world.tree import Is, Item, Node, Value, World

# Each level takes four Python calls, so all levels take 400 of the 1000 calls that Python allows. An arm
# nests two nodes per joint.
MAX_DEPTH = 100

_RESERVED = frozenset(
    (b"DEF", b"USE", b"IS", b"NULL", b"TRUE", b"FALSE", b"PROTO", b"EXTERNPROTO", b"IMPORTABLE")
)
_NAME = re.compile(rb"""[^"'.\\]+""")
_CONSTANTS: dict[bytes, bool | None] = {b"TRUE": True, b"FALSE": False, b"NULL": None}


def parse(source: bytes, name: str = "world") -> World:
    """Return the world that `source` describes; `name` is its name in errors.

    Raises:
        WorldError: the bytes are not a world file; the message has the position, the fact and the remedy.
    """
    text = Source(data=source, name=name)
    header = text.header()
    return Reader(text, tokenize(text)).world(header)


def parse_nodes(text: str, name: str) -> World:
    """Return the nodes of a text without a header, as a client sends them; `name` is its name in errors.

    Raises:
        WorldError: the text does not describe nodes; the message has the position, the fact and the remedy.
    """
    source = Source(data=text.encode(), name=name, headless=True)
    return Reader(source, tokenize(source)).world("")


class Reader:
    """A position in a sequence of tokens, and the rules that move it."""

    def __init__(self, source: Source, tokens: Tokens) -> None:
        self._source = source
        self._tokens = tokens
        self._coming = iter(tokens)
        self._next = next(self._coming)
        self._taken_up_to = 0  # the byte after the last token taken
        self._is_refused: str | None = "found IS outside a PROTO file"  # None where IS is allowed
        self._last_counts = False  # whether a field may occur twice: then the last value counts

    def world(self, header: str) -> World:
        """Read `file := header (["IMPORTABLE"] "EXTERNPROTO" string | node)*`."""
        nodes, externs = [], []
        while (token := self._peek()).kind != "end":
            if token.text in (b"IMPORTABLE", b"EXTERNPROTO"):
                externs.append(self._extern())
            else:
                nodes.append(self._node(1))
        return World(
            source=self._source.data,
            header=header,
            nodes=tuple(nodes),
            externs=tuple(externs),
            tokens=self._tokens,
        )

    def _extern(self) -> Token:
        """Return the address of `["IMPORTABLE"] "EXTERNPROTO" string`."""
        self._skip(b"IMPORTABLE")
        if not self._skip(b"EXTERNPROTO"):
            token = self._peek()
            fact = f"found {shown(token)} where EXTERNPROTO should be"
            raise self._error(token, fact, "only an EXTERNPROTO can be IMPORTABLE")
        address = self._take()
        if address.kind != "string":
            fact = f"found {shown(address)} where the address of an EXTERNPROTO should be"
            raise self._error(address, fact, "write it as a string")
        return address

    def _node(self, depth: int) -> Node:
        """Read `node := "USE" name | ["DEF" name] type "{" entry* "}"`."""
        first = self._peek()
        if depth > MAX_DEPTH:
            fact = f"nodes are nested more than {MAX_DEPTH} deep"
            raise self._error(first, fact, "use fewer Pose and Group nodes around them")
        if self._skip(b"USE"):
            uses = self._name("a DEF name after USE")
            return Node(type_name="", def_name=None, uses=uses, fields={}, span=self._span(first))
        def_name = self._name("a DEF name after DEF") if self._skip(b"DEF") else None
        type_name = self._name("the type of a node")
        opening = self._take()
        if opening.text != b"{":
            fact = f'found {shown(opening)} where the "{{" of {type_name} should be'
            word = type_name.upper()
            wrong_case = word.encode() in _RESERVED
            remedy = f"write {word} in capital letters" if wrong_case else "a node is written Type { … }"
            raise self._error(opening, fact, remedy)
        fields = self._fields(type_name, opening, depth)
        span = self._span(first)
        return Node(type_name=type_name, def_name=def_name, uses=None, fields=fields, span=span)

    def _fields(self, type_name: str, opening: Token, depth: int) -> dict[str, Value]:
        """Return the entries up to and including the closing brace of a node."""
        fields: dict[str, Value] = {}
        while not self._skip(b"}"):
            token = self._peek()
            if token.kind == "end":
                fact = f'the "{{" of {type_name} is never closed'
                raise self._error(opening, fact, 'add the missing "}"')
            hidden = "hidden " if self._skip(b"hidden") else ""
            name = hidden + self._name(f"a field of {type_name}")
            if name in fields and not self._last_counts:
                fact = f"{type_name} has the field {name} twice"
                raise self._error(token, fact, "keep one of them")
            fields[name] = self._value(name, depth)
        return fields

    def _value(self, name: str, depth: int) -> Value:
        """Read `value := "IS" name | "[" item* "]" | number+ | item`."""
        first = self._peek()
        items: list[Item] = []
        if self._skip(b"IS"):
            items.append(self._reference(first, name))
            return Value(items=tuple(items), bracketed=False, span=self._span(first))
        if bracketed := self._skip(b"["):
            while not self._skip(b"]"):
                if self._peek().kind == "end":
                    fact = f'the "[" of {name} is never closed'
                    raise self._error(first, fact, 'add the missing "]"')
                items.append(self._item(name, depth))
        else:
            items.append(self._item(name, depth))
            while first.kind == "number" and self._peek().kind == "number":
                items.append(self._item(name, depth))
        return Value(items=tuple(items), bracketed=bracketed, span=self._span(first))

    def _reference(self, first: Token, name: str) -> Is:
        """Read the name after the token `first`, the IS of the field `name`."""
        if self._is_refused is not None:
            raise self._error(first, self._is_refused, f"write the value of {name}")
        return Is(name=self._name("a field of the PROTO after IS"))

    def _item(self, name: str, depth: int) -> Item:
        """Read `item := number | string | "TRUE" | "FALSE" | "NULL" | node`."""
        token = self._peek()
        if token.kind == "number":
            return float(self._take().text)
        if token.kind == "string":
            return unquoted(self._take())
        if token.text in _CONSTANTS:
            return _CONSTANTS[self._take().text]
        if token.kind == "word":
            return self._node(depth + 1)
        raise self._error(token, f"found {shown(token)} where a value of {name} should be", "write a value")

    def _span(self, first: Token) -> tuple[int, int]:
        """Return the span from the token `first` to the end of the last token taken."""
        return (first.start, self._taken_up_to)

    def _name(self, role: str) -> str:
        """Take a name; `role` is its description for an error."""
        token = self._take()
        if token.kind != "word" or token.text in _RESERVED or not _NAME.fullmatch(token.text):
            fact = f"found {shown(token)} where {role} should be"
            raise self._error(token, fact, "remove it or add what is missing before it")
        return intern(token.text.decode())  # saves memory: a world repeats a few names

    def _peek(self) -> Token:
        return self._next

    def _take(self) -> Token:
        """Return the next token and move past it, but never past the end."""
        token = self._next
        if token.kind != "end":
            self._taken_up_to = token.end
            self._next = next(self._coming)
        return token

    def _skip(self, text: bytes) -> bool:
        """Move past the next token if its text is `text`; return whether the text was equal."""
        if self._next.text != text:
            return False
        self._take()
        return True

    def _error(self, token: Token, fact: str, remedy: str) -> WorldError:
        return self._source.error(token.start, fact, remedy)


def shown(token: Token) -> str:
    """Return a token for an error message, shortened."""
    return "the end of the file" if token.kind == "end" else glance(token.text.decode())
