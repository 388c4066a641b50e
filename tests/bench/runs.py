"""Complete local runs: the time to resume after a kill, the time to end a sidecar, and the memory."""

import os
import re
import signal
import time
from pathlib import Path

from tests.bench.sizes import scaled
from tests.jobs import example
from tests.local_run import REAPER, is_running, running

WARM_STEPS = 1500
PATIENCE_S = 180
PROGRAMS = ("palaestra-train", "palaestra-stub", "palaestra-sidecar", REAPER, "palaestra-ros-master")


def measure_recovery(scale=1.0):
    """Return the result of `recovery` for a run that trains."""
    return measured(recovery, scale)


def measure_shutdown(scale=1.0):
    """Return the result of `shutdown` for a run that trains."""
    return measured(shutdown, scale)


def measure_memory(scale=1.0):
    """Return the result of `memory` for a run that trains."""
    return measured(memory, scale)


def measured(figures, scale):
    """Start a run of move-to-target, and return the result of `figures` after some steps."""
    with running(example("move-to-target")) as run:
        run.wait_for_step(scaled(WARM_STEPS, scale), PATIENCE_S)
        return figures(run)


def recovery(run):
    """Return the seconds from the SIGKILL of the collecting stub to the next environment step."""
    before = run.ask()["step"]
    stub = run.pid_of("palaestra-stub", "collect-0.wbt")
    killed = time.monotonic()
    os.kill(stub, signal.SIGKILL)
    run.until(lambda: recovered(run.status(), before), PATIENCE_S, look_every_s=0.05)
    return {"seconds_to_training_again": round(time.monotonic() - killed, 1)}


def shutdown(run):
    """Return the seconds from the SIGTERM of the collecting sidecar to the end of sidecar and stub."""
    sidecar, stub = (run.pid_of(it, "sim-collect-0/") for it in ("palaestra-sidecar", "palaestra-stub"))
    asked = time.monotonic()
    os.kill(sidecar, signal.SIGTERM)
    run.until(lambda: not any(map(is_running, (sidecar, stub))), PATIENCE_S, look_every_s=0.01)
    return {"seconds_to_the_end": round(time.monotonic() - asked, 2)}


def memory(run):
    """Return the resident memory of a run's programs in megabytes, the maximum for each program."""
    return {f"{program}_mb": max(map(resident_mb, run.pids(program))) for program in PROGRAMS}


def recovered(status, step):
    """Return whether training is past `step` after a restart."""
    return bool(status and status["step"] > step and any(it["restarts"] for it in status["simulators"]))


def resident_mb(pid):
    """Return the resident memory of a process in megabytes."""
    status = Path(f"/proc/{pid}/status").read_text()
    return round(int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024)
