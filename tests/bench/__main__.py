"""`make bench`: measure the promised figures and print them as JSON.

The load of machines varies, so a figure is a ratio within one run, or is printed next to the figure to which
it is compared. Arguments select parts by name, e.g. `python -m tests.bench stepping parallel`. `--scale 0.1`
runs a tenth of each part, which tests that the part works.
"""

import argparse
import json
import sys
import time

from tests.bench import (
    abroad,
    batch,
    collection,
    hostile,
    learning,
    newcomer,
    operator,
    operator_planning,
    parallel,
    plain,
    runs,
    simulators,
    step_floor,
    stepping,
    watched,
    webots,
)

PARTS = {
    "stepping": stepping.measure,
    "floor": step_floor.measure,
    "batch": batch.measure,
    "simulators": simulators.measure,
    "webots": webots.measure,
    "watched": watched.measure,
    "parallel": parallel.measure,
    "collection": collection.measure,
    "recovery": runs.measure_recovery,
    "shutdown": runs.measure_shutdown,
    "memory": runs.measure_memory,
    "operator": operator.measure,
    "planning": operator_planning.measure,
    "hostile": hostile.measure,
    "newcomer": newcomer.measure,
    "plain": plain.measure,
    "learning": learning.measure,
    "navigating": learning.measure_navigate,
    "sparse": learning.measure_sparse,
    "transfer": abroad.measure_transfer,
    "seeing": abroad.measure_seeing,
}


def main():
    """Print one JSON object per line: the part, its duration in seconds, and its figures."""
    parser = argparse.ArgumentParser(prog="tests.bench", description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"from {', '.join(PARTS)}; default: all")
    parser.add_argument("--scale", type=float, default=1.0, help="share of the full size (default: 1)")
    asked = parser.parse_args()
    chosen = asked.parts or list(PARTS)
    if unknown := [name for name in chosen if name not in PARTS]:
        parser.error(f"{unknown[0]} is not a part; choose from {', '.join(PARTS)}")
    for name in chosen:
        started = time.monotonic()
        found = PARTS[name](asked.scale)
        line = {"part": name, "scale": asked.scale, "seconds": round(time.monotonic() - started, 1), **found}
        sys.stdout.write(json.dumps(line) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    main()
