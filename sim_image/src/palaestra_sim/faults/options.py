"""Read the faults, their seed and the number of this life from the command line and the environment."""

from __future__ import annotations

import argparse
import secrets
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Final

from palaestra_sim.faults.kinds import FaultEvent, InjectedFault
from palaestra_sim.faults.parser import FaultError, parse

FAULTS: Final = "PALAESTRA_STUB_FAULTS"
SEED: Final = "PALAESTRA_STUB_FAULT_SEED"
START: Final = "PALAESTRA_SIMULATOR_START"  # the number of this start, counted by the sidecar
_MOST_DRAWN: Final = 1_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Ordered:
    """The faults of this process.

    Attributes:
        faults: first the faults of the command line, then the faults of the environment, both in their
            written order.
        seed: the seed of all random draws.
        life: the number of this start of the simulator, from 1.
        counted: whether a sidecar or a person chose `life`; otherwise `life` is random.
    """

    faults: tuple[InjectedFault, ...]
    seed: int
    life: int
    counted: bool

    def __str__(self) -> str:
        life = f"life {self.life}" if self.counted else f"--fault-life {self.life}, drawn"
        return f"{' '.join(fault.text for fault in self.faults)} (seed {self.seed}, {life})"


def add_options(add: Callable[..., Any]) -> None:
    """Add the options for faults to a parser; `add` is the parser's `add_argument`."""
    add("--fault", action="append", default=[], metavar="KIND[:KEY=VALUE,...]", help="a fault; repeatable")
    add("--fault-seed", metavar="N", help="seed of all random draws (default: 0)")
    add("--fault-life", metavar="N", help="number of this start of the simulator, from 1 (default: random)")


def read_options(options: argparse.Namespace, environment: Mapping[str, str]) -> Ordered | None:
    """Return the faults of the command line and the environment; None if there are no faults.

    Raises:
        FaultError: a description or a number is wrong.
    """
    return _ordered(options.fault, options.fault_seed, options.fault_life, environment)


def read_environment(environment: Mapping[str, str]) -> Ordered | None:
    """Return the faults that the environment describes; None if it describes none.

    Raises:
        FaultError: a description or a number is wrong.
    """
    return _ordered((), None, None, environment)


def _ordered(
    texts: Sequence[str], seed_text: str | None, life_text: str | None, environment: Mapping[str, str]
) -> Ordered | None:
    faults = tuple(
        fault
        for where, text in (*(("--fault", it) for it in texts), (FAULTS, environment.get(FAULTS, "")))
        for fault in parse(text, where)
    )
    if not faults:
        return None
    seed = _whole(0, ("--fault-seed", seed_text), (SEED, environment.get(SEED)))
    life = _whole(1, ("--fault-life", life_text), (START, environment.get(START)))
    _check(faults, counted=life is not None)
    return Ordered(
        faults=faults,
        seed=seed or 0,
        life=secrets.randbelow(_MOST_DRAWN) + 1 if life is None else life,
        counted=life is not None,
    )


def _check(faults: tuple[InjectedFault, ...], *, counted: bool) -> None:
    texts = [fault.text for fault in faults]
    for fault in faults:
        if texts.count(fault.text) > 1:
            raise FaultError(f"fault {fault.text}: is given twice; remove one")
        trigger = fault.trigger
        if not counted and trigger.event is FaultEvent.START and (trigger.at or trigger.every > 1):
            raise FaultError(
                f"fault {fault.text}: the number of this start is unknown;"
                " give --fault-life N, or start the stub through its sidecar"
            )


def _whole(least: int, *given: tuple[str, str | None]) -> int | None:
    """Return the first given number; None if no number is given."""
    for where, text in given:
        if text is None:
            continue
        if not (text.isascii() and text.isdigit() and int(text) >= least):
            raise FaultError(f"{where}: {text!r} is refused; give a whole number of at least {least}")
        return int(text)
    return None
