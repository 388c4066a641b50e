"""What two runs of one workload have in common: their end states, without what differs by nature.

Pure. An end state becomes leaves, each with a path. Times, uids, versions and numbers in sentences are
replaced by what they are; what differs between two undisturbed runs all the same is masked.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Any

Leaves = dict[str, Any]

# In the order in which they are replaced: a uid and a time have numbers in them.
SHAPES = (
    (re.compile(r"\b[0-9a-f]{8}(-[0-9a-f]{4}){3}-[0-9a-f]{12}\b"), "<uid>"),
    (re.compile(r"\b\d{4}-\d\d-\d\dT[\d:.]+Z"), "<time>"),
    (re.compile(r"\bplace-\d+-\d+\b"), "<namespace>"),
    (re.compile(r"\b127(\.\d+){3}\b"), "<address>"),  # of a trainer, where one was free
    (re.compile(r"(?<=[-_])([0-9a-f]{10}|[0-9a-f]{8}|[0-9a-f]{6})\b"), "<digest>"),  # of a uid or a namespace
    (re.compile(r"(-\d+)-[a-z0-9]{5}\b"), r"\1-<pod>"),  # what the Job controller adds to a Job's name
)
NUMBER = re.compile(r"\d+(\.\d+)?")
DROPPED = frozenset({"managedFields", "resourceVersion"})
# What only trainers tell: true or not, it is written when a poll brings it, and no count hangs on it.
TOLD = frozenset(
    {"target", "furthestStep", "lastCheckpoint", "lastProgress", "stepsLost", "goodput", "faults"}
)
SENTENCES = frozenset({"message", "note"})
SECONDS = re.compile(r"(Seconds|_s)$")
LONGEST = 100  # characters of a value in a report: a world has thousands
KEYS = ("type", "name", "index", "container")  # what tells the members of a list apart, in this order


def leaves(state: Any, path: str = "") -> Leaves:
    """Return the leaves of a JSON value by path, with what differs by nature replaced by its shape."""
    found: Leaves = {}
    for key, value in _members(state):
        below = f"{path}/{key}"
        if key in DROPPED | TOLD:
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
    """Return how a run's end differs from the undisturbed one's, a sentence for each path."""
    return [
        f"{path}: {_shown(path, found)} in place of {_shown(path, wanted)}"
        for path in sorted(wanted.keys() | found.keys())
        if path not in masked and _differs(path, wanted, found)
    ]


def shaped(text: str) -> str:
    """Return a text with its uids, times and made-up names replaced by what they are."""
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
