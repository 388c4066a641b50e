"""The measured chapters of docs/explain/peers.md, made from docs/explain/peers.json.

`make peers` measures the figures again and writes both files.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from palaestra.api.generated_sections import between_marks
from tools.peers.operators import CHAPTER as OPERATORS
from tools.peers.rllib import chapter as rllib_chapter
from tools.peers.rows import CHAPTERS, Chapter, Row

PAGE = "docs/explain/peers.md"
RECORDED = "docs/explain/peers.json"
MEASURED = (*CHAPTERS, OPERATORS)  # all chapters except the one that also needs figures of other parts
COMMAND = f"python -m tests.bench --record {RECORDED}"
BEGIN = "<!-- generated: measured comparisons -->"
OPTIONS = {"rllib": "--rllib PYTHON "}
AGAIN = "**These figures were measured while other programs used the machine, and are to be measured again.**"
BUSY = 0.5  # share of the processors; with a higher load average before a part, its figures are marked

Recorded = Mapping[str, Mapping[str, Any]]


def page(text: str, root: Path) -> str:
    """Return docs/explain/peers.md with new chapters; `text` is its present content.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, chapters(json.loads((root / RECORDED).read_text(encoding="utf-8"))))


def chapters(recorded: Recorded) -> str:
    """Return a chapter for each part; a part that is not recorded has a chapter without figures."""
    wanted = [*MEASURED, rllib_chapter(recorded)]
    return "\n".join(_chapter(each, recorded.get(each.part)) for each in wanted)


def loses(row: Row, figures: Mapping[str, Any]) -> bool:
    """Return whether Palaestra's figure is the worse one."""
    ours, theirs = row.ours(figures), row.theirs(figures)
    return ours < theirs if row.more_is_better else ours > theirs


def _chapter(chapter: Chapter, part: Mapping[str, Any] | None) -> str:
    lines = [f"## {chapter.title}", "", chapter.text, ""]
    if part is None:
        command = f"{COMMAND} {OPTIONS.get(chapter.part, '')}{chapter.part}"
        return "\n".join((*lines, f"- Not measured yet; the command is `{command}`.", ""))
    figures = part["figures"]
    rows = chapter.rows(figures)
    lines += [*_table(rows, figures), ""]
    if phases := figures.get("phases_s"):
        shown = ", ".join(f"{name} {seconds:g} s" for name, seconds in phases.items())
        lines += [f"The medians of the phases are: {shown}.", ""]
    lines += [f"- {_measured(part)}", f"- Limit: {chapter.limit}"]
    if any(loses(row, figures) for row in rows):
        lines += [f"- Rows in which Palaestra loses are bold. {chapter.reason}"]
    if _was_busy(part):
        lines += [f"- {AGAIN}"]
    return "\n".join((*lines, ""))


def _table(rows: Sequence[Row], figures: Mapping[str, Any]) -> Iterator[str]:
    yield "| compared with | Palaestra | the other | Palaestra / the other |"
    yield "|---|---|---|---|"
    for row in rows:
        ours, theirs = row.ours(figures), row.theirs(figures)
        ratio = f"{ours / theirs:.2f}" if theirs else "the other made no step"
        shown = f"**{ratio}**" if loses(row, figures) else ratio
        yield f"| {row.what} | {ours:g} {row.unit} | {theirs:g} {row.unit} | {shown} |"


def _measured(part: Mapping[str, Any]) -> str:
    """Return the command, the machine and the versions, as one item."""
    versions = ", ".join(f"{name} {version}" for name, version in sorted(part["versions"].items()))
    machine = part["machine"]
    before, after = part["load"]
    return (
        f"`{part['command']}` on {machine['processors']} processors ({machine['processor']}), with a load of "
        f"{before:g} before and {after:g} after it. Versions: {versions}."
    )


def _was_busy(part: Mapping[str, Any]) -> bool:
    return bool(part["load"][0] > BUSY * part["machine"]["processors"])
