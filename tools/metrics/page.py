"""The tables of docs/reference/metrics.md, made from the families that the programs declare.

This module is in tools/, because operator and trainer do not import each other.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from palaestra.api.generated_sections import between_marks
from palaestra.operator import metric_definitions as operator
from palaestra_protocol.metrics import Family, Label, MetricType
from palaestra_sim.sidecar import metric_definitions as sidecar
from palaestra_trainer.run.telemetry import metric_definitions as trainer

PAGE = "docs/reference/metrics.md"
SERIES = "<!-- generated: how many series -->"
PROCESS = 6  # series of process_*, which prometheus_client exports in each program
MOST_NAMED = 10  # the table lists the values of a label up to this number, and only counts more values

JOBS, REPLICAS, SIMULATORS, NAMESPACES = 1000, 2, 3, 50
SIZES: Mapping[str, int] = {
    "release": 1,
    "simulator": SIMULATORS,
    "simulator of the sidecar": 1,
    "namespace with jobs": NAMESPACES,
    "kind of object": 12,
    "HTTP status that occurred": 8,
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Program:
    """One program that serves metrics, and the number of its instances in a large cluster."""

    name: str
    families: Sequence[Family]
    count: int

    @property
    def mark(self) -> str:
        """The mark in the page after which the program's table begins."""
        return f"<!-- generated: metrics of the {self.name} -->"

    @property
    def series(self) -> int:
        """The maximum number of series of one instance, including its series process_*."""
        return sum(family.series(SIZES) for family in self.families) + PROCESS


PROGRAMS = (
    Program(name="operator", families=operator.FAMILIES, count=1),
    Program(name="trainer", families=trainer.FAMILIES, count=JOBS * REPLICAS),
    Program(name="sidecar", families=sidecar.FAMILIES, count=JOBS * REPLICAS * SIMULATORS),
)


def page(text: str) -> str:
    """Return docs/reference/metrics.md with new tables; `text` is its present content.

    Raises:
        ValueError: a mark is missing.
    """
    for program in PROGRAMS:
        text = between_marks(text, program.mark, table(program.families))
    return between_marks(text, SERIES, cardinality())


def table(families: Sequence[Family]) -> str:
    """Return a row for each family."""
    rows = (
        f"| `{it.name}` | {_type(it)} | {'<br>'.join(map(_label, it.labels))} | {it.meaning} |"
        for it in families
    )
    return "\n".join(("| metric | type | labels | meaning |", "|---|---|---|---|", *rows, ""))


def cardinality() -> str:
    """Return the number of series in a large cluster, by program and in total."""
    rows = [f"| {it.name} | {it.series} | {it.count:,} | {it.series * it.count:,} |" for it in PROGRAMS]
    total = sum(it.series * it.count for it in PROGRAMS)
    cluster = f"{JOBS:,} jobs that all run, of {REPLICAS} replicas with {SIMULATORS} simulators each"
    return "\n".join(
        (
            f"{cluster}, in {NAMESPACES} namespaces:",
            "",
            "| program | series of one program, at most | number of programs | series |",
            "|---|---|---|---|",
            *rows,
            f"| all | | | {total:,} |",
            "",
        )
    )


def _type(family: Family) -> str:
    if family.kind is not MetricType.HISTOGRAM:
        return family.kind
    first, last = family.buckets[0], family.buckets[-1]
    return f"histogram, {len(family.buckets)} bounds from {first:g} to {last:g}"


def _label(label: Label) -> str:
    if label.bound:
        return f"`{label.name}`: one for each {label.bound}"
    values = ", ".join(label.values) if len(label.values) <= MOST_NAMED else f"{len(label.values)} values"
    return f"`{label.name}`: {values}"
