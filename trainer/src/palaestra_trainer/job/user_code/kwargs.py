"""Check the options of a job against the keyword arguments of a class or function."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

from palaestra_trainer.job.configuration import nearest

_NAMED = (inspect.Parameter.POSITIONAL_OR_KEYWORD, inspect.Parameter.KEYWORD_ONLY)


class AcceptedArguments:
    """The keyword arguments that a class or function accepts.

    Args:
        taker: the class or function.
        name: name of the class or function in messages.
    """

    def __init__(self, taker: Callable[..., Any], name: str) -> None:
        signature = inspect.signature(taker)
        self._name = name
        self._named = named(signature)
        self._any = takes_any(signature)

    def accepts(self, name: str) -> bool:
        """Return whether the class or function accepts an argument of this name."""
        return self._any or name in self._named

    def mistakes(self, field: str, options: Iterable[str], others: Iterable[str] = ()) -> Iterator[str]:
        """Yield a message with field, fact and remedy for each unknown option and each missing argument.

        Args:
            field: the field of the job with the options.
            options: the names of the arguments that the job gives.
            others: the names of the arguments that the trainer adds.
        """
        known = list(self._named)
        for name in options:
            if not self.accepts(name):
                remedy = nearest(name, known) if known else "it has no arguments, so remove this one"
                yield f"{field}.{name}: {self._name} has no such argument; {remedy}"
        given = {*options, *others}
        for name, parameter in self._named.items():
            if parameter.default is inspect.Parameter.empty and name not in given:
                yield f"{field}.{name}: {self._name} needs this argument; set it, or give it a default"


def named(signature: inspect.Signature) -> Mapping[str, inspect.Parameter]:
    """Return the parameters of a signature that a caller can pass by name, except for its `**kwargs`."""
    return {name: found for name, found in signature.parameters.items() if found.kind in _NAMED}


def takes_any(signature: inspect.Signature) -> bool:
    """Return whether a signature has `**kwargs`, and so accepts every name."""
    return any(found.kind is inspect.Parameter.VAR_KEYWORD for found in signature.parameters.values())
