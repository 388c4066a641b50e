"""Parse the tokens of a world file, or of a PROTO file, into a tree.

Recursive descent with one function for each rule of the grammar. A number limits the depth, not Python's
stack. For any bytes the result is a World or a WorldError.
"""

import re

from palaestra_sim.errors import WorldError
from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import Token, tokenize, unquoted
from palaestra_sim.world.tree import Is, Item, Node, Proto, ProtoField, Value, World

# Four Python calls a level, so 400 of the 1000 that Python allows. An arm nests two nodes a joint.
MAX_DEPTH = 100

_GLANCE = 40  # characters of a token in an error
_RESERVED = frozenset(
    (b"DEF", b"USE", b"IS", b"NULL", b"TRUE", b"FALSE", b"PROTO", b"EXTERNPROTO", b"IMPORTABLE")
)
_DECLARING = frozenset(
    (b"field", b"hiddenField", b"vrmlField", b"w3dField", b"unconnectedField", b"deprecatedField")
)
_TEMPLATE = re.compile(rb"^[^#\n]*?(%[<{])", re.MULTILINE)
_NAME = re.compile(rb"""[^"'.\\]+""")
_CONSTANTS: dict[bytes, bool | None] = {b"TRUE": True, b"FALSE": False, b"NULL": None}


def parse(source: bytes, name: str = "world") -> World:
    """Return the world that `source` describes; `name` is its name in errors.

    Raises:
        WorldError: the bytes are no world file; the message has the place, the fact and the remedy.
    """
    text = Source(data=source, name=name)
    header = text.header()
    return _Reader(text, tokenize(text)).world(header)


def parse_proto(source: bytes, name: str = "PROTO") -> Proto:
    """Return the PROTO that a file without templates describes; `name` is its name in errors.

    Raises:
        WorldError: the bytes are no such file; the message has the place, the fact and the remedy.
    """
    text = Source(data=source, name=name)
    text.header()
    if template := _TEMPLATE.search(source):
        remedy = "describe it in a file of stand-ins, or leave it out"
        raise text.error(template.start(), "a template, which only Webots can run", remedy)
    return _Reader(text, tokenize(text), in_proto=True).proto()


class _Reader:
    """A position in a sequence of tokens, and the rules that move it."""

    def __init__(self, source: Source, tokens: tuple[Token, ...], *, in_proto: bool = False) -> None:
        self._source = source
        self._tokens = tokens
        self._at = 0
        self._in_proto = in_proto

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

    def proto(self) -> Proto:
        """Read `file := header extern* "PROTO" name "[" declaration* "]" "{" node "}"`."""
        externs = []
        while self._peek().text in (b"IMPORTABLE", b"EXTERNPROTO"):
            externs.append(self._extern())
        self._expect(b"PROTO")
        name = self._name("the name of a PROTO")
        self._expect(b"[")
        fields: dict[str, ProtoField] = {}
        while not self._skip(b"]"):
            declared, field = self._declaration()
            fields[declared] = field
        self._expect(b"{")
        body = self._node(1)
        self._expect(b"}")
        return Proto(name=name, source=self._source, externs=tuple(externs), fields=fields, body=body)

    def _declaration(self) -> tuple[str, ProtoField]:
        """Read `declaration := "field" type ["{" token* "}"] name value`."""
        keyword = self._take()
        if keyword.text not in _DECLARING:
            fact = f"{_shown(keyword)} where the field of a PROTO should be"
            raise self._error(keyword, fact, "write field SFFloat name 0")
        type_name = self._name("the type of a field")
        if self._skip(b"{"):
            self._skip_to_close()
        name = self._name("the name of a field")
        return name, ProtoField(type_name=type_name, default=self._value(name, 1))

    def _skip_to_close(self) -> None:
        """Skip the values to which a PROTO's field is restricted."""
        depth = 1
        while depth:
            token = self._take()
            if token.kind == "end":
                raise self._error(token, 'a "{" is never closed', 'add the missing "}"')
            depth += (token.text == b"{") - (token.text == b"}")

    def _expect(self, text: bytes) -> None:
        token = self._take()
        if token.text != text:
            fact = f"{_shown(token)} where {text.decode()} should be"
            raise self._error(token, fact, "a PROTO is written PROTO Name [ fields ] { node }")

    def _extern(self) -> Token:
        """Return the address of `["IMPORTABLE"] "EXTERNPROTO" string`."""
        self._skip(b"IMPORTABLE")
        if not self._skip(b"EXTERNPROTO"):
            token = self._peek()
            fact = f"{_shown(token)} where EXTERNPROTO should be"
            raise self._error(token, fact, "only an EXTERNPROTO can be IMPORTABLE")
        address = self._take()
        if address.kind != "string":
            fact = f"{_shown(address)} where the address of an EXTERNPROTO should be"
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
            fact = f'{_shown(opening)} where the "{{" of {type_name} should be'
            raise self._error(opening, fact, "a node is written Type { … }")
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
            if name in fields:
                fact = f"{type_name} has the field {name} twice"
                raise self._error(token, fact, "keep one of them")
            fields[name] = self._value(name, depth)
        return fields

    def _value(self, name: str, depth: int) -> Value:
        """Read `value := "[" item* "]" | number+ | item`."""
        first = self._peek()
        if self._skip(b"IS"):
            if not self._in_proto:
                raise self._error(first, "IS outside a PROTO file", f"write the value of {name}")
            bound = Is(self._name("the name of a PROTO's field"))
            return Value(items=(bound,), bracketed=False, span=self._span(first))
        items: list[Item] = []
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
        raise self._error(token, f"{_shown(token)} where a value of {name} should be", "write one")

    def _span(self, first: Token) -> tuple[int, int]:
        """Return the span from the token `first` to the last one taken."""
        return (first.start, self._tokens[self._at - 1].end)

    def _name(self, role: str) -> str:
        """Take a name; `role` is its description for an error."""
        token = self._take()
        if token.kind != "word" or token.text in _RESERVED or not _NAME.fullmatch(token.text):
            fact = f"{_shown(token)} where {role} should be"
            raise self._error(token, fact, "remove it or add what is missing before it")
        return token.text.decode()

    def _peek(self) -> Token:
        return self._tokens[self._at]

    def _take(self) -> Token:
        """Return the next token and move past it, but never past the end."""
        token = self._tokens[self._at]
        if token.kind != "end":
            self._at += 1
        return token

    def _skip(self, text: bytes) -> bool:
        """Move past the next token if it is this word or mark; return whether it was."""
        if self._tokens[self._at].text != text:
            return False
        self._at += 1
        return True

    def _error(self, token: Token, fact: str, remedy: str) -> WorldError:
        return self._source.error(token.start, fact, remedy)


def _shown(token: Token) -> str:
    """Return a token for an error message, shortened to `_GLANCE` characters."""
    if token.kind == "end":
        return "the end of the file"
    text = token.text.decode()
    return text if len(text) <= _GLANCE else text[:_GLANCE] + "…"
