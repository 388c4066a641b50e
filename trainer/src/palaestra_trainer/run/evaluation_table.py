"""Format evaluations of one policy in several simulators as a table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

HEAD = f"{'simulator':<10}{'success':>8}  {'95 % interval':<14}{'return':>9}{'steps':>8}{'faults':>8}"


def row(result: Mapping[str, Any]) -> str:
    """Return the row of one result of `run.evaluate.in_each`."""
    rate, interval = result["success_rate"], result["success_interval"]
    bounds = "" if interval is None else f"{interval['low']:.0%} to {interval['high']:.0%}"
    success = "unknown" if rate is None else f"{rate:.0%}"
    return (
        f"{result['simulator']:<10}{success:>8}  {bounds:<14}"
        f"{result['mean_return']:>9.2f}{result['mean_length']:>8.1f}{result['faults']:>8}"
    )
