"""Compare the end states of two runs of one workload, without values that differ in every run.

Pure. An end state becomes leaves, each with a path. Times, uids, versions and numbers in sentences are
replaced by placeholders. If two undisturbed runs still differ at a path, this path is masked: it is not
compared in later runs.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any

Leaves = dict[str, Any]

# The order matters: a uid and a time contain numbers.
SHAPES = (
    (re.compile(r"\b[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\b"), "<uid>"),
    (re.compile(r"\b\d{4}-\d\d-\d\dT[\d:.]+Z"), "<time>"),
    (re.compile(r"\bplace-\d+-\d+\b"), "<namespace>"),
    (re.compile(r"\b127(\.\d+){3}\b"), "<address>"),  # a trainer listens at the first free address
    # A digest in the name of an object, made from a uid or a namespace.
    (re.compile(r"(?<=[-_])([0-9a-f]{10}|[0-9a-f]{8}|[0-9a-f]{6})\b"), "<digest>"),
    (re.compile(r"(-\d+)-[a-z0-9]{5}\b"), r"\1-<pod>"),  # the Job controller's random suffix
)
NUMBER = re.compile(r"\d+(\.\d+)?")
DROPPED = frozenset({"managedFields", "resourceVersion"})
# Only trainers report these fields, and their values depend on the time of the last poll.
REPORTED = frozenset(
    {"target", "furthestStep", "lastCheckpoint", "lastProgress", "stepsLost", "goodput", "faults"}
)
SENTENCES = frozenset({"message", "note"})
SECONDS = re.compile(r"(Seconds|_s)$")
LONGEST = 100  # the most characters of a value in a report, because a world has thousands
KEYS = ("type", "name", "index", "container")  # the fields that identify the members of a list, in this order


def leaves(state: Any, path: str = "") -> Leaves:
    """Return the leaves of a JSON value by path, with placeholders for values that differ in every run."""
    found: Leaves = {}
    for key, value in _members(state):
        below = f"{path}/{key}"
        if key in DROPPED | REPORTED:
            continue
        if isinstance(value, (Mapping, list)) and value:
            found |= leaves(value, below)
        else:
            found[shaped(below)] = _leaf(key, value)
    return found


def mask(first: Leaves, second: Leaves) -> frozenset[str]:
    """Return the paths at which two undisturbed runs differ."""
    return frozenset(path for path in first.keys() | second.keys() if _differs(path, first, second))


def differences(wanted: Leaves, found: Leaves, masked: frozenset[str]) -> list[str]:
    """Return one sentence for each path at which a run's end state differs from the undisturbed one."""
    return [
        f"{path}: {_shown(path, found)} in place of {_shown(path, wanted)}"
        for path in sorted(wanted.keys() | found.keys())
        if path not in masked and _differs(path, wanted, found)
    ]


def shaped(text: str) -> str:
    """Return a text with placeholders for uids, times and generated names."""
    for pattern, shape in SHAPES:
        text = pattern.sub(shape, text)
    return text


def _differs(path: str, first: Leaves, second: Leaves) -> bool:
    return (path in first, first.get(path)) != (path in second, second.get(path))


def _shown(path: str, state: Leaves) -> str:
    return repr(state[path])[:LONGEST] if path in state else "nothing"


def _leaf(key: str, value: Any) -> Any:
    if isinstance(value, str):
        text = shaped(value)
        return NUMBER.sub("<number>", text) if key in SENTENCES else text
    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    return "<seconds>" if is_number and SECONDS.search(key) else value


def _members(state: Any) -> Iterator[tuple[str, Any]]:
    if isinstance(state, Mapping):
        yield from ((str(key), value) for key, value in state.items())
    elif isinstance(state, list):
        for number, value in enumerate(state):
            yield _key(value, number), value


def _key(value: Any, number: int) -> str:
    if isinstance(value, Mapping):
        for key in KEYS:
            if isinstance(value.get(key), (str, int)):
                return f"[{value[key]}]"
    return f"[{number}]"
