"""The defaults of each algorithm, in docs/reference/trainingjob.md.

Another module, in the operator, makes the rest of that page. These two modules are separate, because the
operator does not import the trainer.
"""

import json
from collections.abc import Iterator
from typing import Any

from palaestra.api.generated_sections import between_marks
from palaestra_trainer.algorithms import ALGORITHMS

PAGE = "docs/reference/trainingjob.md"
BEGIN = "<!-- generated: default hyperparameters -->"


def page(text: str) -> str:
    """Return docs/reference/trainingjob.md with a new table; `text` is its present content.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, table())


def table() -> str:
    """Return a row for each hyperparameter, with its default for each algorithm that has it."""
    names = list(ALGORITHMS)
    known = dict.fromkeys(name for entry in ALGORITHMS.values() for name in entry.defaults)
    rows = (f"| `{name}` | {' | '.join(_cells(name))} |" for name in known)
    return "\n".join(
        (f"| hyperparameter | {' | '.join(names)} |", "|---" * (len(names) + 1) + "|", *rows, "")
    )


def _cells(name: str) -> Iterator[str]:
    for entry in ALGORITHMS.values():
        if name not in entry.defaults:
            yield ""
        elif name in entry.arena and entry.arena[name] != entry.defaults[name]:
            yield f"{_value(entry.defaults[name])}, arena {_value(entry.arena[name])}"
        else:
            yield _value(entry.defaults[name])


def _value(value: Any) -> str:
    return f"`{json.dumps(value)}`"
