"""Read JSON from an untrusted process.

A pod may run a program of a user. The response of this program may have a value of a wrong type, be endless,
or contain characters that cannot be encoded. So each method of `Fields` checks the type and the bounds of a
value, and raises `ProtocolError` if the check fails. Readers of responses ignore unknown fields, because a
newer release may add fields. Readers of requests refuse an unknown field, because it is probably a
misspelling.

Writers keep the same bounds with `clipped`, `enumerated` and `known`. For messages whose fields declare their
bounds, `palaestra_protocol.messages` provides reader and writer.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Sequence
from datetime import datetime
from enum import StrEnum
from typing import TypeVar, cast

from palaestra_protocol.masking import masked

T = TypeVar("T")
Choice = TypeVar("Choice", bound=StrEnum)

MOST_BYTES = 2**19  # maximum size of a response: enough for the longest texts with each character escaped
MOST_COUNT = 2**53  # JSON readers that use floats represent integers exactly up to this number
MOST_NAME = 255
MOST_TEXT = 500

_RFC3339 = re.compile(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d(\.\d{1,9})?(Z|[+-]\d\d:\d\d)", re.ASCII)

_TYPES = {dict: "an object", list: "a list", str: "text", bool: "true or false", type(None): "null"}


class ProtocolError(ValueError):
    """A message does not follow the protocol; the error text names the field and the mistake."""


def decoded(data: bytes, most_bytes: int = MOST_BYTES) -> object:
    """Return the JSON value of `data`.

    Raises:
        ProtocolError: `data` is longer than `most_bytes`, or is not JSON.
    """
    if len(data) > most_bytes:
        raise ProtocolError(f"body: {len(data)} bytes are more than {most_bytes}")
    try:
        return cast("object", json.loads(data))
    except (ValueError, RecursionError) as error:
        raise ProtocolError(f"body: is not JSON ({type(error).__name__})") from error


def clipped(text: str, most: int = MOST_TEXT) -> str:
    """Return the first `most` characters of `text`, without the passwords of addresses.

    Characters that UTF-8 cannot encode are replaced.
    """
    return masked(text)[:most].encode("utf-8", "replace").decode()


def enumerated(texts: Sequence[str], most: int, most_entries: int) -> list[str]:
    """Return at most `most_entries` texts, each `clipped`.

    If there are more texts, the last entry is "and N more", where N is the number of dropped texts.
    """
    kept = [clipped(text, most) for text in texts[:most_entries]]
    if missing := len(texts) - len(kept):
        kept[-1] = f"and {missing + 1} more"
    return kept


def known(value: float | None) -> float | None:
    """Return `value`, or None for infinities and NaN, because JSON has no text for them."""
    return value if value is not None and math.isfinite(value) else None


class Fields:
    """Reads the fields of one JSON object, with one method for each type of value.

    Every method raises ProtocolError if the field is missing or has another type or value.

    Args:
        content: the result of `json.loads`.
        path: the path of the object, such as "simulators[1]"; "" for the whole body.
    """

    def __init__(self, content: object, path: str = "") -> None:
        self._path = path
        if not isinstance(content, dict):
            raise ProtocolError(f"{path or 'body'}: {_kind(content)} is not an object")
        self._content = cast("dict[str, object]", content)

    def only(self, *names: str) -> None:
        """Raise ProtocolError for any field that is not among `names`."""
        for name in self._content:
            if name not in names:
                raise self.error(clipped(name, MOST_NAME), "is not a field of this request")

    def has(self, name: str) -> bool:
        """Return whether the field is present and not null."""
        return self._content.get(name) is not None

    def text(self, name: str, most: int = MOST_TEXT, least: int = 0) -> str:
        """Return the field's text, which has `least` to `most` characters."""
        return _text(self._value(name), self._at(name), most, least)

    def texts(self, name: str, most: int, most_entries: int) -> tuple[str, ...]:
        """Return a list of at most `most_entries` texts of at most `most` characters each."""
        return self.parts(name, lambda item, path: _text(item, path, most), most_entries)

    def choice(self, name: str, choices: type[Choice]) -> Choice:
        """Return the member of `choices` that the field's text names."""
        value = self.text(name)
        try:
            return choices(value)
        except ValueError:
            allowed = ", ".join(choices)
            raise self.error(name, f"{value[:40]!r} is not one of {allowed}") from None

    def whole(self, name: str, least: int = 0, most: int = MOST_COUNT) -> int:
        """Return an integer from `least` to `most`."""
        value = self._value(name)
        if not isinstance(value, int) or isinstance(value, bool):
            raise self.error(name, f"{_kind(value)} is not an integer")
        if not least <= value <= most:
            raise self.error(name, f"is not between {least} and {most}")
        return value

    def number(self, name: str, least: float = -math.inf, most: float = math.inf) -> float:
        """Return a finite number from `least` to `most`."""
        value = self._value(name)
        if not isinstance(value, int | float) or isinstance(value, bool):
            raise self.error(name, f"{_kind(value)} is not a number")
        try:
            number = float(value)
        except OverflowError:
            raise self.error(name, "is not finite") from None
        if not math.isfinite(number):
            raise self.error(name, "is not finite")
        if not least <= number <= most:
            raise self.error(name, f"is not between {least:g} and {most:g}")
        return number

    def flag(self, name: str) -> bool:
        """Return the field's Boolean."""
        value = self._value(name)
        if not isinstance(value, bool):
            raise self.error(name, f"{_kind(value)} is not true or false")
        return value

    def time(self, name: str) -> str:
        """Return a time in RFC 3339."""
        text = self.text(name, MOST_NAME)
        if not _RFC3339.fullmatch(text) or not _exists(text):
            raise self.error(name, "is not a time such as 2025-01-31T12:00:00Z")
        return text

    def part(self, name: str, read: Callable[[object, str], T]) -> T:
        """Pass the object in the field `name` to `read`, and return the result."""
        return read(self._value(name), self._at(name))

    def parts(self, name: str, read: Callable[[object, str], T], most: int) -> tuple[T, ...]:
        """Pass each object of the list in the field `name` to `read`, and return the results in order."""
        value = self._value(name)
        if not isinstance(value, list):
            raise self.error(name, f"{_kind(value)} is not a list")
        items = cast("list[object]", value)
        if len(items) > most:
            raise self.error(name, f"has {len(items)} entries, more than {most}")
        return tuple(read(item, f"{self._at(name)}[{place}]") for place, item in enumerate(items))

    def _value(self, name: str) -> object:
        if name not in self._content:
            raise self.error(name, "is missing")
        return self._content[name]

    def _at(self, name: str) -> str:
        return f"{self._path}.{name}" if self._path else name

    def error(self, name: str, fact: str) -> ProtocolError:
        """Return an error with the path of a field and a fact, such as "is missing"."""
        return ProtocolError(f"{self._at(name)}: {fact}")


def _text(value: object, path: str, most: int, least: int = 0) -> str:
    """Return `value` if it is text of `least` to `most` characters; errors name its `path`.

    Raises:
        ProtocolError: `value` is not such text, or has half of a surrogate pair.
    """
    if not isinstance(value, str):
        raise ProtocolError(f"{path}: {_kind(value)} is not text")
    if not least <= len(value) <= most:
        raise ProtocolError(f"{path}: has {len(value)} characters; allowed are {least} to {most}")
    if any("\ud800" <= character <= "\udfff" for character in value):
        raise ProtocolError(f"{path}: contains an unpaired surrogate")
    return value


def _kind(value: object) -> str:
    """Return the type of a JSON value in words, for a message; the value itself may be too long."""
    return _TYPES.get(type(value), "a number")


def _exists(time: str) -> bool:
    """Return whether the date and time exist in the calendar."""
    try:
        datetime.fromisoformat(time)
    except ValueError:
        return False
    return True
