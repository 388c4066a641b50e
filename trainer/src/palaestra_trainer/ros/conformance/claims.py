"""The claims about the ROS interface, and the verdict on each claim after the calls."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any, Final

Answer = Mapping[str, Any]
Call = tuple[str, str, str, Mapping[str, Any]]  # name, path, type, request

FAILED: Final = "failed"  # the key of the reason in the answer of a call that failed
TRAINING: Final = "training"  # the claims that a simulator must fulfill so that a job can train in it
_FILE: Final = "interface.json"
_INSERT: Final = "supervisor/field/insert_"
_TOLERANCE: Final = 1e-6  # relative and absolute; numbers within this tolerance count as equal


@dataclass(frozen=True, slots=True, kw_only=True)
class Claims:
    """The interface of one kind of simulator, or the part of it that a training needs.

    Attributes:
        robot: the ROS name of the robot in the world.
        world: the text of the world file with every device.
        calls: the calls in their order. A call that returns a handle has a name of its own; the name of any
            other call is its path.
        topics: the type of each topic, by path.
        last: the calls that restart or end the simulator, in their order.
        expected: the fields of a response that are known in advance, by path.
        fails: the paths whose calls must fail.
        step_ms: the period of a step of the world, in ms of simulated time.
    """

    robot: str
    world: str
    calls: Sequence[Call]
    topics: Mapping[str, str]
    last: Sequence[Call]
    expected: Mapping[str, Answer]
    fails: frozenset[str]
    step_ms: int


@dataclass(frozen=True, slots=True, kw_only=True)
class ClaimVerdict:
    """The verdict on one claim.

    Attributes:
        path: the service or topic.
        type_name: its type.
        problem: the difference from the claim; "" if the claim holds.
    """

    path: str
    type_name: str
    problem: str = ""


def subjects() -> tuple[str, ...]:
    """Return the subjects of claims: the kinds of simulators on the page, and `TRAINING`."""
    return (*_read()["fails"], TRAINING)


def claims(simulator: str) -> Claims:
    """Return the claims about a kind of simulator, or those of `TRAINING`.

    Raises:
        KeyError: no claims have this subject.
    """
    data = _read()
    if simulator == TRAINING:
        return Claims(**data[TRAINING], expected={}, fails=frozenset())
    absent = set(data["absent"][simulator])
    return Claims(
        robot=data["robot"],
        world=data["world"],
        calls=[
            (name, path, kind, request) for name, path, kind, request in data["calls"] if path not in absent
        ],
        topics={path: kind for path, kind in data["topics"].items() if path not in absent},
        last=[
            (name, path, kind, request) for name, path, kind, request in data["last"] if path not in absent
        ],
        expected=data["expected"],
        fails=frozenset(data["fails"][simulator]),
        step_ms=data["step_ms"],
    )


def verdicts(asked: Claims, answers: Mapping[str, Answer], heard: Mapping[str, Any]) -> list[ClaimVerdict]:
    """Return a verdict on each service that was called and on each topic.

    Args:
        asked: the claims.
        answers: the responses by the name of the call; a call that failed has only the key `failed`.
        heard: the first message of each topic that has sent one.
    """
    found = [
        ClaimVerdict(path=path, type_name=kind, problem=_problem(asked, path, answers[name]))
        for name, path, kind, _ in (*asked.calls, *asked.last)
        if name == path and name in answers
    ]
    return found + [
        ClaimVerdict(path=path, type_name=kind, problem="" if path in heard else "no message arrived")
        for path, kind in asked.topics.items()
    ]


def _problem(asked: Claims, path: str, answer: Answer) -> str:
    refused = FAILED in answer or not answer.get("success", 1)
    if path in asked.fails:
        empty = refused or not next(iter(answer.values()), None)
        return "" if empty else f"succeeds, but cannot have an effect: {answer}"
    if FAILED in answer:
        return str(answer[FAILED])
    if path.startswith(_INSERT):
        return "" if refused else "inserts a second value into a field with one value"
    if refused:
        return "returns no success"
    wrong = {
        name: answer.get(name)
        for name, value in asked.expected.get(path, {}).items()
        if not _equal(answer.get(name), value)
    }
    return f"returns {wrong} instead of {dict(asked.expected[path])}" if wrong else ""


def _equal(found: Any, wanted: Any) -> bool:
    """Return whether two values are equal, up to the rounding of numbers."""
    if isinstance(wanted, Mapping):
        return isinstance(found, Mapping) and all(_equal(found.get(name), it) for name, it in wanted.items())
    if isinstance(wanted, list):
        return len(found) == len(wanted) and all(map(_equal, found, wanted))
    if isinstance(wanted, float):
        return math.isclose(float(found), wanted, rel_tol=_TOLERANCE, abs_tol=_TOLERANCE)
    return bool(found == wanted)


@cache
def _read() -> Any:
    return json.loads(resources.files("palaestra_trainer.ros.conformance").joinpath(_FILE).read_text())
