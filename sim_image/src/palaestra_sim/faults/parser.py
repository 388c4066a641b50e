"""Parse descriptions of faults: KIND, or KIND:KEY=VALUE,KEY=VALUE, with spaces between faults.

Pure: text in, data or an error out. A description needs no quotes in YAML. In a shell, a description needs
quotes only if it contains `*`.
"""

from __future__ import annotations

import dataclasses
import math
import struct
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from signal import Signals
from typing import Any, Final

from palaestra_sim.errors import SimError
from palaestra_sim.faults import kinds
from palaestra_sim.faults.kinds import FaultEvent, InjectedFault, Trigger

_MOST_MS: Final = 3_600_000.0
_MOST_MIB: Final = 1_048_576.0
# A wrong value can replace a float32 or a float64, so it must fit into the smaller type, float32.
_FLOAT32: Final = struct.Struct("<f")
_SIGNALS: Final = ("SIGABRT", "SIGBUS", "SIGFPE", "SIGILL", "SIGKILL", "SIGSEGV")


class FaultError(SimError, ValueError):
    """The description of a fault is wrong, so the stub does not start."""


def _whole(least: int, most: int) -> Callable[[str], int]:
    def read(text: str) -> int:
        if not (text.isascii() and text.isdigit() and least <= int(text) <= most):
            raise ValueError(f"a whole number from {least} to {most:,}")
        return int(text)

    return read


def _number(least: float, most: float, scale: float = 1.0) -> Callable[[str], float]:
    def read(text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not least <= number <= most:
            raise ValueError(f"a number from {least:,.10g} to {most:,.10g}")
        return number * scale

    return read


def _signal(text: str) -> Signals:
    if text not in _SIGNALS:
        raise ValueError(f"one of {', '.join(_SIGNALS)}")
    return Signals[text]


def _value(text: str) -> float:
    try:
        number = float(text)
        _FLOAT32.pack(number)
    except (ValueError, OverflowError):
        raise ValueError("a number in the range of a 32-bit float, nan, inf or -inf") from None
    return number


def _path(text: str) -> str:
    if not text:
        raise ValueError("a path below the robot's name, such as ir1/enable; * stands for anything")
    return text


@dataclass(frozen=True, slots=True, kw_only=True)
class _Key:
    """A key of a description: its field in the fault class, and the parser of its value.

    If the value is wrong, the parser raises a ValueError that describes the allowed values.
    """

    field: str
    read: Callable[[str], Any]


_SERVICE: Final = {"service": _Key(field="service", read=_path)}
_TOPIC: Final = {"topic": _Key(field="topic", read=_path)}
_DELAY: Final = {
    "latency_ms": _Key(field="latency_s", read=_number(0.0, _MOST_MS, 0.001)),
    "jitter_ms": _Key(field="jitter_s", read=_number(0.0, _MOST_MS, 0.001)),
}
_CODE: Final = {"code": _Key(field="code", read=_whole(0, 255))}
_COUNT: Final = _whole(1, 10**12)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kind:
    """A kind of fault: its class, its keys, and the events at which it can occur.

    The first of `events` is the default of the key `on`: `every` counts these events, and `probability`
    applies to each of them. `topic` is the default topic for a description that names neither a topic nor a
    service. If `needs` is not empty, a description must contain at least one of these keys.
    """

    make: type[InjectedFault]
    keys: Mapping[str, _Key] = dataclasses.field(default_factory=dict)
    events: tuple[FaultEvent, ...] = (FaultEvent.STEP, FaultEvent.RESET)
    topic: str = ""
    needs: tuple[str, ...] = ()


_START: Final = (FaultEvent.START,)
_MESSAGES: Final = (FaultEvent.STEP,)
_MEMORY: Final = {
    "mib": _Key(field="mib", read=_number(0.001, _MOST_MIB)),
    "most_mib": _Key(field="most_mib", read=_number(0.001, _MOST_MIB)),
}
KINDS: Final[Mapping[str, _Kind]] = {
    "crash": _Kind(make=kinds.Crash, keys={"signal": _Key(field="signal", read=_signal)}),
    "exit": _Kind(make=kinds.Exit, keys=_CODE),
    "hang": _Kind(make=kinds.Hang, keys=_SERVICE),
    "slow": _Kind(make=kinds.Slow, keys={**_DELAY, **_SERVICE}, needs=tuple(_DELAY)),
    "late": _Kind(
        make=kinds.Late, keys={**_DELAY, **_TOPIC}, events=_MESSAGES, topic="*", needs=tuple(_DELAY)
    ),
    "lost": _Kind(make=kinds.Lost, keys=_TOPIC, events=_MESSAGES, topic="*"),
    "wrong_value": _Kind(
        make=kinds.WrongValue,
        keys={"value": _Key(field="value", read=_value), **_TOPIC, **_SERVICE},
        events=_MESSAGES,
        topic="*",
    ),
    "wrong_shape": _Kind(make=kinds.WrongShape, keys={**_TOPIC, **_SERVICE}, events=_MESSAGES, topic="*"),
    "memory_growth": _Kind(make=kinds.MemoryGrowth, keys=_MEMORY),
    "start_refused": _Kind(make=kinds.StartRefused, keys=_CODE, events=_START),
    "slow_start": _Kind(make=kinds.SlowStart, keys=_DELAY, events=_START, needs=tuple(_DELAY)),
    "master_lost": _Kind(make=kinds.MasterLostFault),
    "names_lost": _Kind(make=kinds.NamesLost),
}
_CALLS: Final = (FaultEvent.CALL, FaultEvent.STEP, FaultEvent.RESET)


def parse(text: str, where: str) -> tuple[InjectedFault, ...]:
    """Return the faults in `text`; an error names `where`, the option or variable that holds the text.

    Raises:
        FaultError: a description is wrong.
    """
    return tuple(_Reader(word, where).fault() for word in text.split())


class _Reader:
    """Parses the description of one fault."""

    def __init__(self, text: str, where: str) -> None:
        self._text = text
        self._where = where
        name, _, rest = text.partition(":")
        if name not in KINDS:
            raise self._error(f"{name!r} is not a fault", f"use one of {', '.join(KINDS)}")
        self._kind = KINDS[name]
        self._given = self._pairs(rest) if rest else {}
        self._events = _CALLS if {"service"} <= self._given.keys() & self._kind.keys else self._kind.events

    def fault(self) -> InjectedFault:
        given = dict(self._given)
        trigger = self._trigger(given)
        fields = {}
        for key, text in given.items():
            known = self._kind.keys.get(key)
            if known is None:
                raise self._error(f"{key} is not a key of this fault", f"use {self._keys()}")
            fields[known.field] = self._read(key, known.read, text)
        if self._kind.needs and not set(self._kind.needs) & given.keys():
            raise self._error("it has no duration", f"add {self._kind.needs[0]}=100")
        if {"service", "topic"} <= given.keys():
            raise self._error("it names both a service and a topic", "write a fault for each")
        if "service" not in given:
            fields.setdefault("topic", self._kind.topic)
        return self._kind.make(text=self._text, trigger=trigger, **fields)

    def _pairs(self, rest: str) -> dict[str, str]:
        pairs: dict[str, str] = {}
        for part in rest.split(","):
            key, equals, value = part.partition("=")
            if not equals:
                raise self._error(f"{part!r} has no =", "write KEY=VALUE, with commas between")
            if key in pairs:
                raise self._error(f"{key} is given twice", "remove one")
            pairs[key] = value
        return pairs

    def _trigger(self, given: dict[str, str]) -> Trigger:
        """Return the trigger, and remove its keys from `given`."""
        said = [it for it in ("every", "probability", *FaultEvent) if it in given]
        if len(said) > 1:
            raise self._error(f"{said[0]} and {said[1]} both determine when the fault occurs", "remove one")
        event = self._events[0]
        if "on" in given:
            event = self._event(given.pop("on"))
            if set(said) & set(FaultEvent):
                raise self._error(f"'on' and '{said[0]}' both choose the event to count", "remove 'on'")
        if not said:
            return Trigger(event=event)
        key, text = said[0], given.pop(said[0])
        if key == "probability":
            return Trigger(event=event, probability=self._read(key, _number(0.0, 1.0), text))
        number = self._read(key, _COUNT, text)
        if key == "every":
            return Trigger(event=event, every=number)
        return Trigger(event=self._event(key), at=number)

    def _event(self, text: str) -> FaultEvent:
        if text not in self._events:
            raise self._error(f"it cannot occur at a {text}", f"use {' or '.join(self._events)}")
        return FaultEvent(text)

    def _read(self, key: str, read: Callable[[str], Any], text: str) -> Any:
        try:
            return read(text)
        except ValueError as error:
            raise self._error(f"{key} is {text!r}", f"give {error}") from None

    def _keys(self) -> str:
        return ", ".join([*self._kind.keys, *self._events, "every", "probability", "on"])

    def _error(self, fact: str, remedy: str) -> FaultError:
        return FaultError(f"{self._where}: {self._text}: {fact}; {remedy}")
