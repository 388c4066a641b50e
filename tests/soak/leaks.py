"""After 500 restarts of simulators, no program holds more threads, sockets, descriptors or processes."""

import os
import time
from collections import Counter
from pathlib import Path

from tests.local_run import LOOK_EVERY_S, below, running
from tests.soak.jobs import LITTLE_DQN, tiny_job

RESTARTS = 500
COLLECTORS = 2
# A reset takes two steps, so the simulator always crashes in its first episode.
DIES = "crash:step=6"
WATCHED = ("palaestra-train", "palaestra-sidecar")
# While its simulator runs, a sidecar holds up to three more of each resource. A leak would add hundreds.
SWAY = 4
LONGEST_S = 3600.0


def measure(scale):
    """Return the resources of trainer and sidecars in the first and the last tenth of the restarts."""
    restarts = max(round(RESTARTS * scale), 20)
    with running(job()) as run:
        run.wait_for_step(1)
        early = least(run, restarts // 10, restarts // 5)
        late = least(run, restarts, restarts + restarts // 10)
    return {
        "restarts": restarts,
        "early": early,
        "late": late,
        "grown": grown(early, late),
        "claims": {"no thread, descriptor, socket or process grew": not grown(early, late)},
    }


def job():
    """Return an endless job whose simulators crash repeatedly."""
    return tiny_job(
        collect={"count": COLLECTORS, "recycle": {"afterResets": 0}},
        faults=DIES,
        algorithm=LITTLE_DQN,
        steps=1_000_000,
        evaluation={"everySteps": 0},
        checkpoint={"everySteps": 1_000_000},
    )


def least(run, first, last):
    """Return each program's smallest use of resources between two numbers of restarts.

    The smallest use excludes the resources of a restart in progress.
    """
    run.until(lambda: restarts_of(run) >= first, LONGEST_S)
    least_held = {}
    while restarts_of(run) < last:
        time.sleep(LOOK_EVERY_S)
        for name, held in holdings(run).items():
            before = least_held.get(name, held)
            least_held[name] = {what: min(before[what], held[what]) for what in held}
    return least_held


def grown(early, late):
    """Return the resources of which a program holds more than before.

    Memory is excluded, because the replay buffer grows.
    """
    return [
        f"{name}: {what}"
        for name, held in early.items()
        for what in held
        if what != "rss_mb" and late[name][what] > held[what] + SWAY
    ]


def restarts_of(run):
    """Return the number of restarts of simulators so far."""
    return sum(each["restarts"] for each in run.ask()["simulators"])


def holdings(run):
    """Return the resources that the trainer and each sidecar hold now."""
    found = {}
    for program in WATCHED:
        pids = set(run.pids(program))
        # A forked child has the command line of its parent until it executes another program.
        forked = {pid for each in pids for pid, _ in below(each)}
        for number, pid in enumerate(sorted(pids - forked)):
            found[f"{program} {number}"] = held_by(pid)
    return found


def held_by(pid):
    """Return numbers of threads, descriptors, sockets and processes, and megabytes of memory."""
    process = Path(f"/proc/{pid}")
    opened = Counter(kind for it in (process / "fd").iterdir() if (kind := kind_of(it)))
    pages = int((process / "statm").read_text().split()[1])
    return {
        "threads": len(list((process / "task").iterdir())),
        "descriptors": opened.total(),
        "sockets": opened["socket"],
        "processes": len(list(below(pid))),
        "rss_mb": round(pages * os.sysconf("SC_PAGE_SIZE") / 2**20),
    }


def kind_of(descriptor):
    """Return a descriptor's kind in the kernel's words (socket, pipe or a path), or "" if it is closed."""
    try:
        return str(descriptor.readlink()).partition(":")[0]
    except OSError:
        return ""
