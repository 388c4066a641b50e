"""Error messages about fields, for the author of a job; each has the fact and the remedy."""

import difflib
import json
import re
from collections.abc import Callable
from typing import Any

from pydantic_core import ErrorDetails

from palaestra.api.fields import ALGORITHM, PATTERNS
from palaestra.api.job import TrainingJob
from palaestra.api.model_walk import fields_of, model_at, walk
from palaestra.api.paths import Path, shown
from palaestra.api.text import either
from palaestra_protocol.foreign_words import ELSEWHERE, FROM_ZOO, NO_ALGORITHM, OF_ZOO

_LONGEST_QUOTE = 60
_SIMILAR = 0.6
# A message suggests a field for a name in Python's style if their similarity is at least this value. For
# every_steps the message suggests everySteps, but for n_steps it does not suggest steps.
_MISSPELLED = 0.92
# Sections into which people write hyperparameters of RL Zoo by mistake.
_OF_TRAINING = (("spec",), ("trainer",), ("algorithm",))
_VARIABLES = "env"  # a person who writes `env` more likely means environment variables than an environment


def sentence(path: Path, error: ErrorDetails) -> str:
    """Return "<fact>; <remedy>" for pydantic's error at `path`."""
    value = error["input"]
    if value is None and error["type"] not in _NOT_ABOUT_A_VALUE:
        return "is empty; give a value or remove the line"
    if sentence_of := _SENTENCES.get(error["type"]):
        return sentence_of(path, value, error.get("ctx", {}))
    if error["type"].startswith(("date", "timezone")):
        return f"{quoted(value)} is not a time; write it as 2026-01-31T12:00:00Z"
    return error["msg"]


def quoted(value: Any) -> str:
    """Return `value` as JSON, truncated if it is long; of a mapping or list, return only the type."""
    if isinstance(value, dict | list):
        return "a mapping" if isinstance(value, dict) else "a list"
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= _LONGEST_QUOTE else text[: _LONGEST_QUOTE - 3] + "..."


def _unknown(path: Path, _: Any, __: dict[str, Any]) -> str:
    name = str(path[-1])
    of_training = path[:1] == ("spec",) and path[-2:-1] in _OF_TRAINING
    if of_training and name in ELSEWHERE and name != _VARIABLES:
        return _elsewhere(name)
    model = model_at(TrainingJob, path[:-1])
    known = list(fields_of(model)) if model else []
    elsewhere = [
        shown((*above, name))
        for above, other in walk(TrainingJob)
        if name in fields_of(other) and above[:1] == path[:1]
    ]
    if len(elsewhere) == 1:
        return f"is not a field here; did you mean {elsewhere[0]}?"
    likeness = _MISSPELLED if "_" in name else _SIMILAR
    if near := difflib.get_close_matches(_camel(name), known, n=1, cutoff=likeness):
        return f"is not a field; did you mean {near[0]}?"
    if of_training and "_" in name:
        return f"is not a field; write a hyperparameter as spec.trainer.algorithm.hyperparameters.{name}"
    return f"is not a field; use {either(known)}"


def _elsewhere(name: str) -> str:
    zoo = f" ({FROM_ZOO})" if name in OF_ZOO else ""
    return f"is not a field; {ELSEWHERE[name]}{zoo}"


def _camel(name: str) -> str:
    return re.sub(r"[_-]([a-z])", lambda match: match[1].upper(), name)


def _no_member(path: Path, value: Any, ctx: dict[str, Any]) -> str:
    word = str(path[-2] if path[-1] in {"name", "type", "id"} else path[-1])
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", word).lower()
    article = "an" if words[0] in "aeio" else "a"
    return f"{quoted(value)} is not {article} {words}; use {ctx['expected'].replace(chr(39), '')}"


def _no_match(_: Path, value: Any, ctx: dict[str, Any]) -> str:
    noun, remedy = PATTERNS[ctx["pattern"]]
    if ctx["pattern"] == ALGORITHM and (why := NO_ALGORITHM.get(str(value).lower())):
        return f"{quoted(value)} cannot be used: {why}"
    return f"{quoted(value)} is not {noun}; {remedy}"


def _no_text(_: Path, value: Any, __: dict[str, Any]) -> str:
    if isinstance(value, bool):
        fact = f"{quoted(value)} is not text (YAML reads yes, no, on and off as true or false)"
        return f"{fact}; quote the word"
    if isinstance(value, int | float):
        return f'{value} is a number where text is needed; quote it: "{value}"'
    return f"{quoted(value)} is not text; write one text"


def _no_integer(_: Path, value: Any, __: dict[str, Any]) -> str:
    if isinstance(value, str):
        return f"{quoted(value)} is text; write a whole number without quotes"
    return f"{quoted(value)} is not a whole number; write one"


def _no_number(_: Path, value: Any, __: dict[str, Any]) -> str:
    if isinstance(value, str):
        return f"{quoted(value)} is text; write a number without quotes"
    return f"{quoted(value)} is not a number; write one"


def _no_boolean(_: Path, value: Any, __: dict[str, Any]) -> str:
    return f"{quoted(value)} is neither true nor false; write one of them, without quotes"


def _no_list(_: Path, value: Any, __: dict[str, Any]) -> str:
    shown_value = quoted(value)
    example = shown_value if isinstance(value, str) else "..."
    return f"{shown_value} is not a list; write [{example}] or lines that begin with '- '"


def _too_many(_: Path, __: Any, ctx: dict[str, Any]) -> str:
    return f"has more than {ctx['max_length']} entries; remove some"


_NOT_ABOUT_A_VALUE = {"missing", "extra_forbidden"}

_SENTENCES: dict[str, Callable[[Path, Any, dict[str, Any]], str]] = {
    "missing": lambda *_: "is missing; add it",
    "extra_forbidden": _unknown,
    "enum": _no_member,
    "literal_error": lambda _, value, ctx: (
        f"{quoted(value)} is not known; use {ctx['expected'].replace(chr(39), '')}"
    ),
    "string_pattern_mismatch": _no_match,
    "string_type": _no_text,
    "int_type": _no_integer,
    "float_type": _no_number,
    "bool_type": _no_boolean,
    "tuple_type": _no_list,
    "dict_type": lambda _, value, __: f"{quoted(value)} is not a mapping; write lines of 'key: value'",
    "model_type": lambda _, value, __: f"{quoted(value)} is not a mapping; write lines of 'field: value'",
    "string_too_short": lambda *_: "is empty; give a value or remove the line",
    "string_too_long": lambda _, __, ctx: f"is longer than {ctx['max_length']} characters; shorten it",
    "string_unicode": lambda *_: "contains an invalid Unicode character; remove it",
    "too_short": lambda *_: "has no entry; give one or remove the line",
    "too_long": _too_many,
    "greater_than_equal": lambda _, value, ctx: (
        f"{quoted(value)} is less than {ctx['ge']}; use {ctx['ge']} or more"
    ),
    "less_than_equal": lambda _, value, ctx: (
        f"{quoted(value)} is more than {ctx['le']:g}; use {ctx['le']:g} or less"
    ),
    "greater_than": lambda _, value, ctx: (
        f"{quoted(value)} is not more than {ctx['gt']:g}; use more than {ctx['gt']:g}"
    ),
}
