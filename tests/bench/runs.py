"""Whole local runs: how soon training goes on after a kill, and what the processes take."""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from contextlib import contextmanager
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
PALAESTRA = Path(sys.executable).with_name("palaestra")
JOB = ROOT / "manifests/examples/move-to-target.yaml"
WARM_STEPS = 1500
PATIENCE_S = 180


def measure_recovery():
    """Return the seconds from a SIGKILL of the collecting stub to the next environment step."""
    with local_run() as (process, folder):
        status = wait_for_step(folder, WARM_STEPS, process)
        stub = next(pid for pid, name in programs(process.pid, "palaestra-stub") if "collect-0.wbt" in name)
        killed = time.monotonic()
        os.kill(stub, signal.SIGKILL)
        before = status["step"]
        while not recovered(folder, before):
            if time.monotonic() - killed > PATIENCE_S:
                raise TimeoutError("training did not go on")
            time.sleep(0.05)
        return {"seconds_to_training_again": round(time.monotonic() - killed, 1)}


def measure_memory():
    """Return the resident megabytes of the processes of a run, by kind, the largest of each."""
    with local_run() as (process, folder):
        wait_for_step(folder, WARM_STEPS, process)
        return {
            f"{program}_mb": max(resident_mb(pid) for pid, _ in programs(process.pid, program))
            for program in (
                "palaestra-train",
                "palaestra-stub",
                "palaestra-sidecar",
                "keeper.py",
                "rosmaster",
            )
        }


@contextmanager
def local_run():
    """Yield a `palaestra run` of the main example, and its run directory; interrupted at the end."""
    with tempfile.TemporaryDirectory() as folder:
        process = subprocess.Popen(
            [PALAESTRA, "run", JOB, "--dir", folder], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )
        try:
            yield process, Path(folder) / "move-to-target/0"
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(PATIENCE_S)


def wait_for_step(folder, step, process):
    """Return the trainer's status once it is past `step`."""
    give_up = time.monotonic() + PATIENCE_S
    while time.monotonic() < give_up and process.poll() is None:
        status = status_of(folder)
        if status and status["step"] >= step:
            return status
        time.sleep(0.2)
    raise TimeoutError(f"the run did not come to step {step}")


def recovered(folder, step):
    """Return whether training is past `step` after a restart."""
    status = status_of(folder)
    return bool(status and status["step"] > step and any(it["restarts"] for it in status["simulators"]))


def status_of(folder):
    """Return what the trainer's /status says; None while nobody answers."""
    try:
        address = yaml.safe_load((folder / "training.yaml").read_text())["statusAddress"]
        with urllib.request.urlopen(f"http://{address}/status", timeout=5) as answer:
            return json.load(answer)
    except (OSError, ValueError):
        return None


def programs(ancestor, name):
    """Return pid and command line of the processes below `ancestor` that run the program `name`."""
    return [
        (pid, command)
        for pid, command in processes(ancestor)
        if any(word.endswith(name) for word in command.split()[:4])
        and not any(word.endswith("keeper.py") for word in command.split() if name != "keeper.py")
    ]


def processes(ancestor):
    """Return pid and command line of every process below `ancestor`."""
    table = {}
    for directory in Path("/proc").glob("[0-9]*"):
        try:
            fields = (directory / "stat").read_text().rpartition(")")[2].split()
            command = (directory / "cmdline").read_bytes().replace(b"\0", b" ").decode()
        except OSError:
            continue
        table[int(directory.name)] = (int(fields[1]), command)
    below, found = {ancestor}, []
    while below:
        below = {pid for pid, (parent, _) in table.items() if parent in below}
        found += [(pid, table[pid][1]) for pid in below]
    return found


def resident_mb(pid):
    """Return the resident memory of a process in megabytes."""
    status = Path(f"/proc/{pid}/status").read_text()
    return round(int(re.search(r"VmRSS:\s+(\d+)", status)[1]) / 1024)
