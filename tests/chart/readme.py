"""The chart's README: an introduction, and a table that is generated from values.yaml.

In values.yaml, a comment describes the key on the next line.
"""

import json
from collections.abc import Iterator
from typing import Any, NamedTuple

import yaml

from tests.chart.helm import CHART

PATH = CHART / "README.md"
VALUES = CHART / "values.yaml"
MARK = "<!-- generated from values.yaml by `make golden` -->\n"


class Value(NamedTuple):
    """A value of the chart: dotted path, default, and description, which is "" without a comment."""

    path: str
    default: Any
    sentence: str


def values(source: str) -> Iterator[Value]:
    """Yield every value of a values.yaml file in the file's order."""
    lines = source.splitlines()
    yield from _values(yaml.compose(source), (), lines)


def text() -> str:
    """Return the README with its introduction unchanged and a new table."""
    introduction, _, _ = PATH.read_text().partition(MARK)
    rows = [
        f"| `{value.path}` | `{json.dumps(value.default)}` | {value.sentence} |"
        for value in values(VALUES.read_text())
    ]
    return "\n".join(
        [introduction + MARK, "| value | default | what it is for |", "|---|---|---|", *rows, ""]
    )


def _values(node: yaml.Node, path: tuple[str, ...], lines: list[str]) -> Iterator[Value]:
    assert isinstance(node, yaml.MappingNode)
    for key, value in node.value:
        here, sentence = (*path, key.value), _sentence(lines, key.start_mark.line)
        if isinstance(value, yaml.MappingNode) and value.value and not sentence:
            yield from _values(value, here, lines)
        else:
            default = yaml.safe_load(yaml.serialize(value))
            yield Value(".".join(here), default, sentence)


def _sentence(lines: list[str], row: int) -> str:
    above = row - 1
    return lines[above].strip().removeprefix("# ") if above >= 0 and lines[above].strip()[:1] == "#" else ""
