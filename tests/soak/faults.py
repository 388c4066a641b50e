"""Disturb every write, and many reads, between operator and API server; the jobs' ends must be the same."""

import json
import os
import random
import sys
import tempfile
from collections import Counter
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

from palaestra.cluster.resources import DEFINITIONS
from tests.control_plane.installing import install
from tests.control_plane.plane import running
from tests.faults.plans import plan, plans
from tests.faults.rig import Rig
from tests.faults.workloads import WORKLOADS
from tests.integration.operator.cluster import local_queues
from tests.local_run import ROOT
from tests.waiting import eventually

KINDS = ROOT / "manifests" / "crd.yaml"
AT_ONCE = 2 * (os.cpu_count() or 1) + 1  # runs mostly wait, so more than one per processor can run
FEWEST = 200
SEED = 1  # below full scale, it selects the random sample of plans


def measure(scale):
    """Return how many plans end as undisturbed runs do, and the plans that end differently."""
    with rig() as at, several_at_once() as pool:
        undisturbed = dict(zip(WORKLOADS, pool.map(at.undisturbed, WORKLOADS), strict=True))
        every = list(plans({name: each.counts for name, each in undisturbed.items()}))
        chosen = random.Random(SEED).sample(every, max(round(len(every) * scale), 1))
        runs = list(pool.map(lambda each: told(each, at.run(each)), chosen))
    met = [(each, run) for each, run in zip(chosen, runs, strict=True) if run.met]
    wrong = [
        f"{each.words}: {'; '.join(run.wrong)}" for each, run in zip(chosen, runs, strict=True) if run.wrong
    ]
    return {
        "plans": len(chosen),
        "of": len(every),
        "met": len(met),
        "by_fault": dict(Counter(str(each.fault.kind) for each, _ in met)),
        "by_workload": dict(Counter(each.workload for each, _ in met)),
        "longest_s": max(run.seconds for run in runs),
        "masked": {name: len(each.masked) for name, each in undisturbed.items()},
        "wrong": wrong,
        "claims": {
            "every disturbed run comes to the same as an undisturbed one": not wrong,
            f"at least {FEWEST} plans met what they disturb": scale < 1 or len(met) >= FEWEST,
        },
    }


def repeat(seed):
    """Run only the plan of a seed and return its result."""
    chosen = plan(seed, tuple(WORKLOADS))
    with rig() as at:
        run = at.run(chosen)
    return {
        "plan": chosen.words,
        "met": run.met,
        "lives": run.lives,
        "wrong": run.wrong,
        "claims": {"the run comes to the same as an undisturbed one": not run.wrong},
    }


@contextmanager
def several_at_once() -> Iterator[ThreadPoolExecutor]:
    """Yield a pool that runs several plans at once; an interruption cancels the plans that wait."""
    pool = ThreadPoolExecutor(AT_ONCE)
    try:
        yield pool
    finally:
        pool.shutdown(cancel_futures=True)


@contextmanager
def rig() -> Iterator[Rig]:
    """Run a control plane with Palaestra until the block ends."""
    with (
        tempfile.TemporaryDirectory(prefix="control-plane-") as folder,
        running(Path(folder), kinds=KINDS) as plane,
    ):
        api = install(plane)
        api.create(DEFINITIONS, local_queues())
        eventually(lambda: api.serves("kueue.x-k8s.io"))
        yield Rig(plane, api)
        api.close()


def told(chosen, run):
    """Print a line about a run to standard error, for a person who waits, and return the run."""
    line = {"plan": chosen.words, "met": run.met, "seconds": run.seconds, "wrong": run.wrong}
    sys.stderr.write(json.dumps(line) + "\n")
    return run
