"""Parse a PROTO file: the declaration of a node type by its fields and one node.

    #VRML_SIM R2023b utf8
    EXTERNPROTO "Leg.proto"
    PROTO Stool [
      field SFVec3f translation 0 0 0
    ]
    {
      Solid { translation IS translation }
    }

This module does not expand instances. An instance of the type is a copy of `body` in which every `IS` is
replaced by the instance's value of the field, or else by the default. For any bytes the result is a Proto or
a WorldError. If the file has a template, `body` is that of the default values, and `with_values` returns the
PROTO for the values of an instance; a template that `templates` does not expand is refused.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.world.reader import Reader, shown
from palaestra_sim.world.source import Source
from palaestra_sim.world.template_code import Result, TemplateError
from palaestra_sim.world.templates import Template, first_piece, parse_template
from palaestra_sim.world.tokens import Token, tokenize
from palaestra_sim.world.tree import Is, Item, Node, Value, walk

_ACCESSES = (b"field", b"hiddenField", b"vrmlField", b"unconnectedField", b"deprecatedField")
_NUMBERS = {"Float": 1, "Int32": 1, "Vec2f": 2, "Vec3f": 3, "Color": 3, "Rotation": 4}
_OTHERS: dict[str, tuple[type, ...]] = {"Bool": (bool,), "String": (str,), "Node": (Node, type(None))}
_TYPES = frozenset(f"{many}F{kind}" for many in "SM" for kind in (*_NUMBERS, *_OTHERS))
# The names of the numbers of a vector in the code of a template.
_AXES = {"Vec2f": "xy", "Vec3f": "xyz", "Color": "rgb", "Rotation": "xyza"}


@dataclass(frozen=True, slots=True, kw_only=True)
class ProtoField:
    """A field that a PROTO declares.

    `type` is a type such as "SFVec3f"; `access` is the word before the type, such as "hiddenField". `allowed`
    has the values that the declaration permits; it is empty if all values are permitted.
    """

    type: str
    default: Value
    access: str = "field"
    allowed: tuple[Item, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Proto:
    """A parsed PROTO file: its type, its fields in source order, and its node.

    `externs` are the string tokens of its EXTERNPROTO lines. Every span refers to `source`. `template` is the
    template of the file, if it has one.
    """

    name: str
    externs: tuple[Token, ...] = field(repr=False)
    fields: dict[str, ProtoField]
    body: Node
    source: Source = field(repr=False)
    template: Template | None = field(default=None, repr=False)

    def with_values(self, values: Mapping[str, Value]) -> "Proto":
        """Return this PROTO with the body that its template has for these values of its fields.

        Raises:
            WorldError: the template needs another value, or its result is not a PROTO file.
        """
        template = self.template
        if template is None:
            return self
        used = {
            name: result
            for name in template.fields & self.fields.keys()
            if (result := _result(self.fields[name].type, values.get(name, self.fields[name].default)))
            is not None
        }
        try:
            data = template.expanded(used)
        except TemplateError as error:
            raise _unexpanded(self.source, error, template.start) from None
        return _proto(Source(data=data, name=self.source.name, kind="PROTO"), template)


def parse_proto(data: bytes, name: str) -> Proto:
    """Return the PROTO that `data` declares; `name` is the name of its file in errors.

    Raises:
        WorldError: the bytes are not a PROTO file, or they have a template that is not expanded; the message
            has the position, the fact and the remedy.
    """
    source = Source(data=data, name=name, kind="PROTO")
    source.header()
    piece = first_piece(data)
    if piece is None:
        return _proto(source, None)
    start, head_end = piece
    head = Source(data=data[:head_end], name=name, kind="PROTO")
    try:
        template = parse_template(data, start)
        fields = _ProtoReader(head, tokenize(head)).head()
    except TemplateError as error:
        raise _unexpanded(source, error, start) from None
    except WorldError as error:
        fact = TemplateError(f"code before the body: {error.fact}")
        raise _unexpanded(source, fact, start) from None
    bare = Proto(name=name, externs=(), fields=fields, body=_NO_BODY, source=source, template=template)
    return bare.with_values({})


def _proto(source: Source, template: Template | None) -> Proto:
    """Return the PROTO of a file without code."""
    proto = _ProtoReader(source, tokenize(source)).proto(template)
    if error := refusal(_undeclared(proto)):
        raise error
    return proto


def _unexpanded(source: Source, error: TemplateError, start: int) -> WorldError:
    """Return the error for a template that is not expanded; `start` is the offset of its first code."""
    fact = f"this PROTO has a template with code that is not expanded ({error})"
    remedy = (
        "only if, else, declarations and outputs are expanded; "
        "add this type to a file of stand-ins, or leave it out"
    )
    return source.error(start, fact, remedy)


def _result(kind: str, value: Value) -> Result | None:
    """Return a value as the code of a template sees it; None for a node or a list."""
    items = value.items
    if kind[0] == "M" or not all(isinstance(item, float | bool | str) for item in items):
        return None
    axes = _AXES.get(kind[2:])
    if axes is not None:
        numbers = [item for item in items if isinstance(item, float)]
        return dict(zip(axes, numbers, strict=True)) if len(numbers) == len(axes) else None
    (only,) = items if len(items) == 1 else (None,)
    return only if isinstance(only, float | bool | str) else None


def parse_fields(text: str, name: str) -> dict[str, ProtoField]:
    """Return the fields that `text` declares as a PROTO does; the word before a type may be missing.

    Raises:
        WorldError: the text is not a list of declarations; the error counts its lines from 1.
    """
    source = Source(data=text.encode(), name=name, kind="PROTO")
    return _ProtoReader(source, tokenize(source)).fields(name)


def _undeclared(proto: Proto) -> Iterator[WorldError]:
    """Yield an error for each IS in the body that refers to a field which the PROTO does not have."""
    for node in walk([proto.body]):
        for name, value in node.fields.items():
            for item in value.items:
                if isinstance(item, Is) and item.name not in proto.fields:
                    fact = f"{proto.name} has no field {item.name}"
                    remedy = f"declare it, or write the value of {name}"
                    yield proto.source.error(value.span[0], fact, remedy)


_NO_BODY = Node(type_name="", def_name=None, uses=None, fields={}, span=(0, 0))


class _ProtoReader(Reader):
    """The grammar rules of a PROTO file, in addition to the rules for its nodes."""

    _access_needed = True

    def head(self) -> dict[str, ProtoField]:
        """Return the fields of a PROTO; the text may end inside the body of the PROTO."""
        return self._head()[2]

    def _head(self) -> tuple[list[Token], str, dict[str, ProtoField]]:
        """Read `extern* "PROTO" name "[" declaration* "]" "{"`."""
        self._is_refused = "found IS outside the body of the PROTO"
        externs = []
        while self._peek().text in (b"IMPORTABLE", b"EXTERNPROTO"):
            externs.append(self._extern())
        self._expect(b"PROTO", "a PROTO file has one PROTO after its EXTERNPROTO lines")
        name = self._name("the type of the PROTO")
        fields = self._declarations(name)
        self._expect(b"{", "the body of a PROTO is written { Type { … } }")
        return externs, name, fields

    def proto(self, template: Template | None) -> Proto:
        """Read `file := head node "}"`."""
        externs, name, fields = self._head()
        self._is_refused = None
        self._last_counts = True  # some published PROTOs repeat fields
        body = self._body(name)
        self._expect(b"}", "a PROTO has one node")
        self._end()
        return Proto(
            name=name,
            externs=tuple(externs),
            fields=fields,
            body=body,
            source=self._source,
            template=template,
        )

    def fields(self, proto: str) -> dict[str, ProtoField]:
        """Read `declaration*` to the end of the text."""
        self._is_refused = "found IS outside the body of the PROTO"
        self._access_needed = False
        fields: dict[str, ProtoField] = {}
        while (token := self._peek()).kind != "end":
            self._add(fields, token, proto)
        return fields

    def _declarations(self, proto: str) -> dict[str, ProtoField]:
        """Read `"[" declaration* "]"`."""
        opening = self._peek()
        self._expect(b"[", "the fields of a PROTO are declared in [ … ]")
        fields: dict[str, ProtoField] = {}
        while not self._skip(b"]"):
            token = self._peek()
            if token.kind == "end":
                raise self._error(opening, f'the "[" of {proto} is never closed', 'add the missing "]"')
            self._add(fields, token, proto)
        return fields

    def _add(self, fields: dict[str, ProtoField], token: Token, proto: str) -> None:
        """Read the declaration that begins with `token`, and add it to `fields`."""
        name, declared = self._declaration(proto)
        if name in fields:
            raise self._error(token, f"{proto} declares the field {name} twice", "keep one of them")
        fields[name] = declared

    def _declaration(self, proto: str) -> tuple[str, ProtoField]:
        """Read `declaration := access type ["{" item* "}"] name value`."""
        access = self._access(proto)
        kind = self._take()
        type_name = kind.text.decode()
        if type_name not in _TYPES:
            fact = f"found {shown(kind)} where the type of a field of {proto} should be"
            raise self._error(kind, fact, "write a type such as SFVec3f or MFNode")
        allowed = self._allowed(type_name)
        name = self._name(f"the name of a {type_name} of {proto}")
        default = self._default(type_name, name)
        return name, ProtoField(type=type_name, default=default, access=access, allowed=allowed)

    def _access(self, proto: str) -> str:
        """Read the word before the type of a field."""
        access = self._peek()
        if access.text in _ACCESSES:
            return self._take().text.decode()
        if self._access_needed:
            fact = f"found {shown(access)} where a field of {proto} should be declared"
            raise self._error(access, fact, "write field, a type, a name and a default")
        return "field"

    def _allowed(self, type_name: str) -> tuple[Item, ...]:
        """Read the values to which a field is restricted, `["{" item* "}"]`."""
        opening = self._peek()
        items = []
        if self._skip(b"{"):
            while not self._skip(b"}"):
                if self._peek().kind == "end":
                    fact = f'the "{{" of {type_name} is never closed'
                    raise self._error(opening, fact, 'add the missing "}"')
                items.append(self._item(type_name, 1))
        return tuple(items)

    def _default(self, type_name: str, name: str) -> Value:
        """Read the default of a field, and check that it has the type of the field."""
        first = self._peek()
        default = self._value(name, 1)
        if not _fits(type_name, default):
            fact = f"the default of {name} is not of type {type_name}"
            raise self._error(first, fact, f"write {_example(type_name)}")
        return default

    def _body(self, proto: str) -> Node:
        """Read the node of the PROTO."""
        first = self._peek()
        body = self._node(1)
        if body.uses is not None:
            fact = f"found a USE where the node of {proto} should be"
            raise self._error(first, fact, "write the node out")
        return body

    def _end(self) -> None:
        token = self._peek()
        if token.kind != "end":
            fact = f"found {shown(token)} after the end of the PROTO"
            raise self._error(token, fact, "remove it, or move it to a file of its own")

    def _expect(self, text: bytes, remedy: str) -> None:
        """Move past the next token, whose text must be `text`."""
        token = self._peek()
        if not self._skip(text):
            fact = f"found {shown(token)} where {text.decode()} should be"
            raise self._error(token, fact, remedy)


def _fits(type_name: str, value: Value) -> bool:
    """Return whether a value has the type; a list may be one item without brackets."""
    kind, single = type_name[2:], type_name.startswith("S")
    each_item, count = ((float,), _NUMBERS[kind]) if kind in _NUMBERS else (_OTHERS[kind], 1)
    if not all(isinstance(item, each_item) for item in value.items):
        return False
    if single:
        return not value.bracketed and len(value.items) == count
    return len(value.items) % count == 0 and (value.bracketed or len(value.items) == count)


def _example(type_name: str) -> str:
    """Return a value of a type, for an error."""
    kind = type_name[2:]
    others = {"Bool": "TRUE", "String": '"text"', "Node": "NULL"}
    single = others.get(kind) or " ".join(["0"] * _NUMBERS[kind])
    return single if type_name.startswith("S") else f"[ {single} ]"
