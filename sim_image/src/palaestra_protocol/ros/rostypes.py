"""The ROS types of the interface: md5 sums, and values to and from bytes.

genmsg computes the md5 sums that peers compare, and genpy generates the classes that serialize. Each class is
made in memory at its first use: Debian's packages have few of these types, and genpy's dynamic loader would
leave files behind after a SIGKILL.

Messages of fixed-size numbers alone (every motor command and step) skip genpy for one precompiled struct.
"""

from __future__ import annotations

import collections
import io
import keyword
import struct
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, partial
from itertools import islice, repeat
from types import SimpleNamespace
from typing import Any, NamedTuple, Protocol

import genmsg
import genmsg.gentools
import genpy
import genpy.generator

from palaestra_protocol.ros.definitions import (
    all_nested,
    context_for,
    is_defined,
    message_spec,
    service_spec,
)
from palaestra_protocol.ros.tcpros import frame

_STRUCT_CODES = {
    "bool": "?",
    "int8": "b",
    "uint8": "B",
    "int32": "i",
    "uint32": "I",
    "int64": "q",
    "uint64": "Q",
    "float32": "f",
    "float64": "d",
}


class Codec(Protocol):
    """Turns the values of one message into bytes and back."""

    def encode(self, fields: Mapping[str, Any]) -> bytes:
        """Return the bytes of a message; absent fields are zero, empty or False."""
        ...

    def frame(self, fields: Mapping[str, Any]) -> bytes:
        """Return the bytes of a message after their length, as TCPROS requires."""
        ...

    def decode(self, payload: bytes | memoryview) -> Any:
        """Return an object with one attribute a field.

        Raises:
            ValueError: the bytes are not such a message.
        """
        ...


class MessageType(NamedTuple):
    """One topic type: its name, the md5 that peers compare, its definition, its codec."""

    name: str
    md5: str
    definition: str
    codec: Codec


class ServiceType(NamedTuple):
    """One service type: its name, the md5 that peers compare, and the two codecs."""

    name: str
    md5: str
    request: Codec
    response: Codec


@cache
def message_type(name: str) -> MessageType:
    """Return the message type `package/Name`.

    Raises:
        KeyError: `definitions.txt` has no such message.
    """
    spec = message_spec(name)
    context = context_for(spec)
    return MessageType(
        name,
        genmsg.gentools.compute_md5(context, spec),
        genmsg.gentools.compute_full_text(context, spec),
        _codec(spec),
    )


@cache
def service_type(name: str) -> ServiceType:
    """Return the service type `package/name`.

    Raises:
        KeyError: `definitions.txt` has no such service.
    """
    spec = service_spec(name)
    md5 = genmsg.gentools.compute_md5(context_for(spec.request, spec.response), spec)
    return ServiceType(name, md5, _codec(spec.request), _codec(spec.response))


@cache
def last_field(name: str) -> struct.Struct | None:
    """Return the layout of the last field of the message type `package/Name`; None if it is not of numbers.

    Raises:
        KeyError: `definitions.txt` has no such message.
    """
    type_ = message_spec(name).types[-1]
    record = _record_of(type_) if is_defined(type_) else None
    codes = _STRUCT_CODES.get(type_, "") if record is None else record.codes
    return struct.Struct(f"<{codes}") if codes else None


def _codec(spec: Any) -> Codec:
    record = _record(spec)
    return _StructCodec(record) if record and record.codes else _GenpyCodec(spec)


@dataclass(frozen=True, slots=True)
class _Record:
    """A message of numbers: their struct codes, and how they become attributes.

    Attributes:
        names: of the fields.
        parts: for each field None if it is a number, else the record inside.
        codes: of all numbers, in order.
        make: makes the tuple with attributes.
        flat: whether all fields are numbers.
    """

    names: tuple[str, ...]
    parts: tuple[_Record | None, ...]
    codes: str
    make: Callable[[Iterable[Any]], Any]
    flat: bool

    def flatten(self, fields: Mapping[str, Any]) -> Iterable[Any]:
        """Return the numbers of a message, 0 for absent ones."""
        if self.flat:
            return map(fields.get, self.names, repeat(0))
        numbers: list[Any] = []
        for name, part in zip(self.names, self.parts, strict=True):
            if part is None:
                numbers.append(fields.get(name, 0))
            else:
                numbers += part.flatten(fields.get(name, {}))
        return numbers

    def build(self, numbers: Iterator[Any]) -> Any:
        """Return the message that takes its numbers from an iterator."""
        if self.flat:
            return self.make(islice(numbers, len(self.names)))
        return self.make([part.build(numbers) if part else next(numbers) for part in self.parts])


def _record(spec: Any) -> _Record | None:
    """Return the record of a message of fixed-size numbers; None when there is anything else in it."""
    parts: list[_Record | None] = []
    codes = ""
    for type_ in spec.types:
        part = None
        if type_ in _STRUCT_CODES:
            codes += _STRUCT_CODES[type_]
        elif is_defined(type_) and (part := _record_of(type_)) is not None:
            codes += part.codes
        else:
            return None
        parts.append(part)
    # As in genpy: a field called `from` is an attribute called `from_`.
    names = tuple(name + "_" * keyword.iskeyword(name) for name in spec.names)
    made: Any = collections.namedtuple(spec.short_name, names)  # type: ignore[misc]  # noqa: PYI024 - a run-time name
    return _Record(names, tuple(parts), codes, partial(tuple.__new__, made), not any(parts))


@cache
def _record_of(name: str) -> _Record | None:
    return _record(message_spec(name))


class _StructCodec:
    """A message of fixed-size numbers: one precompiled struct, about ten times as fast as genpy."""

    def __init__(self, record: _Record) -> None:
        self._record = record
        self._struct = struct.Struct("<" + record.codes)
        self._framed = struct.Struct("<I" + record.codes)

    def encode(self, fields: Mapping[str, Any]) -> bytes:
        return self._struct.pack(*self._record.flatten(fields))

    def frame(self, fields: Mapping[str, Any]) -> bytes:
        return self._framed.pack(self._struct.size, *self._record.flatten(fields))

    def decode(self, payload: bytes | memoryview) -> Any:
        try:
            numbers = self._struct.unpack(payload)
        except struct.error as error:
            raise ValueError(f"{len(payload)} bytes for {self._struct.size}") from error
        return self._record.make(numbers) if self._record.flat else self._record.build(iter(numbers))


class _GenpyCodec:
    """A message with strings, lists or messages inside: the class that genpy writes."""

    def __init__(self, spec: Any) -> None:
        self._class = _genpy_class(spec)

    def encode(self, fields: Mapping[str, Any]) -> bytes:
        buffer = io.BytesIO()
        try:
            _fill(self._class(), fields).serialize(buffer)
        except (genpy.SerializationError, AttributeError) as error:
            raise ValueError(f"{self._class.__name__}: {error}") from error
        return buffer.getvalue()

    def frame(self, fields: Mapping[str, Any]) -> bytes:
        return frame(self.encode(fields))

    def decode(self, payload: bytes | memoryview) -> Any:
        try:
            return self._class().deserialize(bytes(payload))
        except genpy.DeserializationError as error:
            raise ValueError(f"{self._class.__name__}: {error}") from error


def _fill(message: Any, fields: Mapping[str, Any]) -> Any:
    for name, value in fields.items():
        if isinstance(value, dict):
            _fill(getattr(message, name), value)
        else:
            setattr(message, name, value)
    return message


@cache
def _class_of(name: str) -> Any:
    return _genpy_class(message_spec(name))


def _genpy_class(spec: Any) -> Any:
    """Return the class for `spec`, with the classes of the messages inside it in reach of its code."""
    lines = genpy.generator.msg_generator(context_for(spec), spec, {})
    source = "\n".join(line for line in lines if not line.startswith("import ") or "msg" not in line)
    namespace: dict[str, Any] = {"genpy": genpy, "struct": struct}
    for name in all_nested(spec):
        package, base = genmsg.package_resource_name(name)
        module = namespace.setdefault(package, SimpleNamespace(msg=SimpleNamespace())).msg
        setattr(module, base, _class_of(name))
        setattr(module, f"_{base}", SimpleNamespace(**{base: _class_of(name)}))
    exec(compile(source, f"<genpy {spec.full_name}>", "exec"), namespace)  # noqa: S102 - genpy's own output
    return namespace[spec.short_name]
