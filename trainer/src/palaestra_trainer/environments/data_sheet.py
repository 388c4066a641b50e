"""The part of a policy's data sheet that an environment determines: spaces, and meanings of the numbers.

Meanings and units come from the tables under the headings for actions and observations in the environment's
docstring. If the docstring has no tables, the sheet has only the spaces.
"""

from __future__ import annotations

import inspect
import itertools
import re
import typing
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Any

import gymnasium
import numpy as np
from gymnasium import spaces

from palaestra_trainer.environments.make import creator_of
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Environment

MOST_BOUNDS = 1_000  # for a space with more numbers, the sheet has only the least and the greatest bound
OBSERVATION = "observation"  # the name of an observation that is not a Dict

Table = list[dict[str, str]]


def parts_of(space: spaces.Space[Any]) -> dict[str, spaces.Space[Any]]:
    """Return the spaces of a Dict by name, or another space under the name OBSERVATION."""
    return dict(space.spaces) if isinstance(space, spaces.Dict) else {OBSERVATION: space}


def environment_sheet(
    observations: Mapping[str, spaces.Space[Any]], actions: spaces.Space[Any], environment: Environment
) -> dict[str, Any]:
    """Return the spaces and tables of an environment, as the JSON data of a data sheet."""
    tables = tables_of(environment)
    return {
        "observations": {
            "spaces": {name: describe(space) for name, space in observations.items()},
            "tables": tables["observation"],
        },
        "actions": {"space": describe(actions), "tables": tables["action"]},
    }


def describe(space: spaces.Space[Any]) -> dict[str, Any]:
    """Return a space as JSON data."""
    known: dict[str, Any] = {
        "kind": type(space).__name__,
        "shape": list(space.shape or ()),
        "dtype": str(space.dtype),
    }
    match space:
        case spaces.Box():
            known |= {"low": _bounds(space.low), "high": _bounds(space.high)}
        case spaces.Discrete():
            known |= {"n": int(space.n), "start": int(space.start)}
        case spaces.MultiDiscrete():
            known |= {"nvec": space.nvec.tolist()}
        case _:
            pass
    return known


def _bounds(values: np.ndarray) -> Any:
    """Return one number for equal bounds, else a list; infinity as text, because JSON has no infinity."""
    if values.size and (values == values.flat[0]).all():
        return _number(values.flat[0])
    if values.size > MOST_BOUNDS:
        return [_number(values.min()), _number(values.max())]
    return [_number(value) for value in values.flat]


def _number(value: Any) -> float | str:
    number = float(value)
    return number if np.isfinite(number) else str(number)


def tables_of(environment: Environment) -> dict[str, list[Table]]:
    """Return the tables of an environment's docstring about observations and actions.

    Wrappers may change observations and actions. So for an environment with wrappers, return empty lists.
    """
    found: dict[str, list[Table]] = {"observation": [], "action": []}
    if environment.wrappers or environment.frame_stack:
        return found
    for heading, text in _chapters(_docstring(environment.id)):
        for topic, tables in found.items():
            if heading.lower().startswith(topic):
                tables.extend(_read(text))
    return found


def _docstring(name: str) -> str:
    """Return the docstring of the environment's class; "" if its module cannot be imported."""
    with suppress(ConfigurationError):
        creator: Any = creator_of(name)
        creator = getattr(creator, "environment_class", creator)
        if not inspect.isclass(creator):
            with suppress(NameError, TypeError):
                creator = typing.get_type_hints(creator).get("return", creator)
        if not inspect.isclass(creator) or issubclass(creator, gymnasium.Env):
            return inspect.getdoc(creator) or ""
    return ""


def _chapters(text: str) -> Iterator[tuple[str, str]]:
    """Yield heading and text of each Markdown section."""
    _, *chapters = re.split(r"^#+ ", text, flags=re.MULTILINE)
    for chapter in chapters:
        heading, _, body = chapter.partition("\n")
        yield heading, body


def _read(text: str) -> Iterator[Table]:
    """Yield the Markdown tables of a text; a table is a list with a dictionary for each row."""
    lines = [line.strip() for line in text.splitlines()]
    for is_table, group in itertools.groupby(lines, key=lambda line: line.startswith("|")):
        if is_table:
            head, *rows = ([cell.strip() for cell in line.strip("|").split("|")] for line in group)
            yield [dict(zip(head, cells, strict=False)) for cells in rows[1:]]
