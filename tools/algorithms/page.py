"""The table of algorithms, observations and actions in docs/reference/algorithms.md.

The reasons in the table are the messages that a trainer prints for a refused combination.
tests/unit/trainer/algorithms/test_algorithms_grid.py trains in every cell that works.
"""

from palaestra.api.generated_sections import between_marks
from palaestra_trainer.algorithms import ALGORITHMS
from palaestra_trainer.algorithms.space_compat import policy_of_spaces
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Algorithm
from palaestra_trainer.testing.fake_task import ACTIONS, OBSERVATIONS

PAGE = "docs/reference/algorithms.md"
BEGIN = "<!-- generated: algorithms, observations and actions -->"
WORKS = "works"


def page(text: str) -> str:
    """Return docs/reference/algorithms.md with a new table; `text` is its present content.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, table())


def refusal(name: str, seen: str, acted: str) -> str:
    """Return the reason for which an algorithm is refused in a task with these spaces; "" if it works."""
    try:
        policy_of_spaces(Algorithm(name=name), ALGORITHMS[name], OBSERVATIONS[seen], ACTIONS[acted])
    except ConfigurationError as error:
        return str(error).splitlines()[0]
    return ""


def table() -> str:
    """Return the table, with rows for algorithm and observation and columns for actions, and its reasons."""
    reasons: dict[str, int] = {}
    rows = []
    for name in ALGORITHMS:
        for seen in OBSERVATIONS:
            found = (refusal(name, seen, acted).replace(name, "NAME") for acted in ACTIONS)
            cells = [_cell(reason, reasons) for reason in found]
            rows.append(f"| {name} | {seen} | {' | '.join(cells)} |")
    return "\n".join(
        (
            f"| algorithm | observation | {' | '.join(f'{acted} actions' for acted in ACTIONS)} |",
            "|---" * (len(ACTIONS) + 2) + "|",
            *rows,
            "",
            *(f"{number}. `{reason}`" for reason, number in reasons.items()),
            "",
        )
    )


def _cell(reason: str, reasons: dict[str, int]) -> str:
    """Return a cell; a new reason gets the next number."""
    return f"refused ({reasons.setdefault(reason, len(reasons) + 1)})" if reason else WORKS
