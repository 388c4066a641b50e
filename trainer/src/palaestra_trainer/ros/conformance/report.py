"""The report of a conformance test, as Markdown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from palaestra_trainer.ros.conformance.claims import ClaimVerdict


def summary(verdicts: Sequence[ClaimVerdict]) -> str:
    """Return one line with the numbers of claims."""
    wrong = sum(bool(verdict.problem) for verdict in verdicts)
    return f"{len(verdicts) - wrong} of {len(verdicts)} claims hold"


def differences(verdicts: Sequence[ClaimVerdict]) -> list[str]:
    """Return a line for each claim that does not hold."""
    return [f"{verdict.path}: {verdict.problem}" for verdict in verdicts if verdict.problem]


def markdown(verdicts: Sequence[ClaimVerdict], facts: Mapping[str, str]) -> str:
    """Return the report: facts about the test, the numbers, the differences, and every claim.

    Args:
        verdicts: the verdicts.
        facts: versions and other facts by name.
    """
    lines = ["# Conformance with the ROS interface", ""]
    lines += [f"- {name}: {value}" for name, value in facts.items()]
    lines += ["", f"{summary(verdicts)}.", "", "| path | type | verdict |", "|---|---|---|"]
    ordered = sorted(verdicts, key=lambda verdict: not verdict.problem)  # the differences first
    lines += [
        f"| `{verdict.path}` | {verdict.type_name} | {_cell(verdict.problem) or 'holds'} |"
        for verdict in ordered
    ]
    return "\n".join(lines) + "\n"


def _cell(text: str) -> str:
    return " ".join(text.split()).replace("|", "\\|")
