"""`make soak`: prove that a training survives faults without supervision. It prints JSON.

Every part runs complete trainings and causes faults in them. It reports figures, and claims that are true or
false. Arguments select parts by name, e.g. `python -m tests.soak recovery kills`. `--scale 0.1` runs only a
tenth of a part, as a test of its code. `faults --seed N` repeats the plan number N of the part `faults`.
"""

import argparse
import json
import sys
import time
import traceback

from tests.soak import chaos, damage, faults, kills, kinds, leaks, recovery, recycling, resume, robots

PARTS = {
    "recovery": recovery.measure,
    "damage": damage.measure,
    "kinds": kinds.measure,
    "kills": kills.measure,
    "resume": resume.measure,
    "leaks": leaks.measure,
    "recycling": recycling.measure,
    "chaos": chaos.measure,
    "faults": faults.measure,
    "robot": robots.measure,
}


def main():
    """Print a line of JSON for each part, and return 1 if a claim does not hold.

    A line contains the part, its seconds, its figures and its claims.
    """
    parser = argparse.ArgumentParser(prog="tests.soak", description=__doc__.splitlines()[0])
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"from {', '.join(PARTS)}; default: all")
    parser.add_argument("--scale", type=float, default=1.0, help="share of the full size (default: 1)")
    parser.add_argument("--seed", type=int, help="number of the only plan to run, for the part `faults`")
    asked = parser.parse_args()
    if asked.seed is not None:
        return 0 if prove(f"faults --seed {asked.seed}", 1.0, lambda _: faults.repeat(asked.seed)) else 1
    chosen = asked.parts or list(PARTS)
    if unknown := [name for name in chosen if name not in PARTS]:
        parser.error(f"{unknown[0]} is not a part; choose from {', '.join(PARTS)}")
    held = [prove(name, asked.scale, PARTS[name]) for name in chosen]
    return 0 if all(held) else 1


def prove(name, scale, measure):
    """Run a part, print its results, and return whether all its claims hold."""
    started = time.monotonic()
    try:
        found = measure(scale)
    except Exception as error:  # noqa: BLE001 - the other parts must run even if this part fails
        traceback.print_exc()
        found = {"error": type(error).__name__, "claims": {"the part came to its end": False}}
    line = {"part": name, "scale": scale, "seconds": round(time.monotonic() - started, 1), **found}
    sys.stdout.write(json.dumps(line) + "\n")
    sys.stdout.flush()
    return all(found["claims"].values())


if __name__ == "__main__":
    sys.exit(main())
