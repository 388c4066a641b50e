"""`make bench`: measure the promised figures and print them as JSON.

The load of machines varies, so the speeds of two runs are not comparable. A figure is therefore a ratio of
two values of the same run, or the part also prints the value with which a reader must compare the figure.
Arguments select parts by name, e.g. `python -m tests.bench stepping parallel`. `--scale 0.1` runs only a
tenth of each part, as a test of its code. `--record FILE` also writes the figures into a file of JSON.
"""

import argparse
import json
import sys
import time
from functools import partial

from tests.bench import (
    abroad,
    batch,
    clients,
    collection,
    foreign_operators,
    goodput,
    hostile,
    learning,
    newcomer,
    operator,
    operator_planning,
    operators,
    parallel,
    plain,
    recording,
    recoveries,
    rllib,
    runs,
    simulators,
    startup,
    step_floor,
    stepping,
    watched,
    webots,
)

PARTS = {
    "stepping": stepping.measure,
    "floor": step_floor.measure,
    "clients": clients.measure,
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
    "operators": operators.measure,
    "operators_many": operators.measure_many,
    "planning": operator_planning.measure,
    "hostile": hostile.measure,
    "newcomer": newcomer.measure,
    "plain": plain.measure,
    "plain_old": plain.measure_old,
    "startup": startup.measure,
    "recoveries": recoveries.measure,
    "goodput": goodput.measure,
    "rllib": rllib.measure,
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
    parser.add_argument(
        "--record", metavar="FILE", help="file of JSON in which the figures replace older ones"
    )
    parser.add_argument("--rllib", metavar="PYTHON", help="interpreter with Ray, for the part `rllib`")
    asked = parser.parse_args()
    chosen = asked.parts or list(PARTS)
    if unknown := [name for name in chosen if name not in PARTS]:
        parser.error(f"{unknown[0]} is not a part; choose from {', '.join(PARTS)}")
    for name in chosen:
        if name == "rllib" and not asked.rllib:
            sys.stderr.write("rllib: skipped; name an interpreter that imports Ray with --rllib\n")
            continue
        measure = partial(rllib.measure, python=asked.rllib) if name == "rllib" else PARTS[name]
        started, before = time.monotonic(), recording.load()
        found = measure(asked.scale)
        line = {"part": name, "scale": asked.scale, "seconds": round(time.monotonic() - started, 1), **found}
        sys.stdout.write(json.dumps(line) + "\n")
        sys.stdout.flush()
        if asked.record:
            recording.record(
                asked.record, line, (before, recording.load()), other_versions(name, asked.rllib)
            )


def other_versions(part, rllib_python):
    """Return the versions of the programs of other projects in a part, by name."""
    if part == "rllib":
        return rllib.versions(rllib_python)
    return foreign_operators.versions() if part == "operators" else {}


if __name__ == "__main__":
    main()
