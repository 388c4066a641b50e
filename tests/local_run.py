"""`palaestra run` as a user types it, and functions to observe it for tests and measurements.

Everything is real: ROS master, sidecars, stubs and trainer are processes of this machine. Tests use only
interfaces that a user has: the run directory, `/status`, and the table of processes.
"""

import json
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
import urllib.request
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

import yaml

from tests.json_lines import whole_lines

ROOT = Path(__file__).parents[1]
EXAMPLES = ROOT / "manifests/examples"
PALAESTRA = Path(sys.executable).with_name("palaestra")
PATIENCE_S = 240.0  # a run takes seconds on an idle machine; pytest's timeout is longer than this
REAPER = "reaper.py"  # the reaper's command line contains the simulator's command line
GONE_S = 10.0  # the longest time that the kernel needs to end killed processes
LOOK_EVERY_S = 0.05  # a poll reads the run and all processes of the machine, which costs processor time
FAULT = re.compile(r"simulator fault .*kind=(\w+)")
STATUS_ADDRESS = re.compile(r"^statusAddress: (\S+)$", re.MULTILINE)


class LocalRun:
    """One `palaestra run` of a job, and its directory; a `with` block starts and ends the run.

    Attributes:
        directory: the run directory of the job's only replica.
        process: the runner; None before the start.
    """

    def __init__(self, folder, job):
        self.name = job["metadata"]["name"]
        self.file = folder / "job.yaml"
        self.file.write_text(yaml.safe_dump(job))
        self.runs = folder / "runs"
        self.directory = self.runs / self.name / "0"
        self.process = None
        self._output = folder / "output.txt"

    def __enter__(self):
        """Start the run."""
        return self.start()

    def __exit__(self, *_):
        """End the run if it has not ended by itself."""
        self.stop()

    def start(self, *options):
        """Start the run, or start it again after its end; `output` returns the text since the last start.

        The kernel terminates the runner when the thread that started it ends.
        """
        command = ["setpriv", "--pdeathsig=TERM", PALAESTRA, "run", self.file, "--dir", self.runs, *options]
        with self._output.open("w") as output:
            self.process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        return self

    def end(self, within_s=PATIENCE_S):
        """Wait for the end of the run, and return exit code and output."""
        return self.process.wait(within_s), self.output()

    def stop(self):
        """Interrupt the run as Ctrl-C does and wait for its end; do nothing if it has ended."""
        if self.process and self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            self.process.wait(PATIENCE_S)

    def output(self):
        """Return the run's output so far."""
        return self._output.read_text()

    def until(self, claim, within_s=PATIENCE_S, look_every_s=LOOK_EVERY_S):
        """Return the first true value of `claim`.

        Raises:
            AssertionError: `claim` returned no true value before the timeout or before the runner ended.
        """
        give_up = time.monotonic() + within_s
        while not (value := claim()):
            ended = self.process.poll()
            if ended is not None or time.monotonic() > give_up:
                why = f"the runner ended with {ended}" if ended is not None else f"not within {within_s:g} s"
                raise AssertionError(f"{why}: {self.output()}\n{self.log()}")
            time.sleep(look_every_s)
        return value

    def status(self):
        """Return the trainer's /status, or None if the trainer does not respond."""
        try:
            found = STATUS_ADDRESS.search((self.directory / "training.yaml").read_text())
            with urllib.request.urlopen(f"http://{found[1]}/status", timeout=5) as answer:
                return json.load(answer)
        except (OSError, ValueError):
            return None

    def ask(self):
        """Wait until the trainer responds, and return its /status."""
        return self.until(self.status)

    def wait_for_step(self, step, within_s=PATIENCE_S):
        """Return the status once training is past `step`."""

        def passed():
            status = self.status()
            return status if status and status["step"] >= step else None

        return self.until(passed, within_s)

    def training(self):
        """Return the resolved job of the replica."""
        return yaml.safe_load((self.directory / "training.yaml").read_text())

    def summary(self):
        """Return the run's summary."""
        return json.loads((self.directory / "summary.json").read_text())

    def lines(self, name):
        """Return the JSON lines of a file in the run directory; none if the file does not exist."""
        path = self.directory / name
        return whole_lines(path) if path.exists() else []

    def attempts(self):
        """Return the reason of each attempt, e.g. `resumed at step 400`."""
        return [line["reason"] for line in self.lines("attempts.jsonl")]

    def checkpoints(self):
        """Return the folders of the run's checkpoints, the newest last."""
        found = (
            it for it in (self.directory / "checkpoints").glob("[0-9]*") if (it / "manifest.json").exists()
        )
        return sorted(found, key=lambda path: int(path.name))

    def log(self, container="trainer"):
        """Return the log of a container, or an empty string before the container has a log."""
        path = self.directory / "logs" / f"{container}.log"
        return path.read_text(errors="replace") if path.exists() else ""

    def faults(self):
        """Return the number of faults of each kind in the trainer's log."""
        return dict(Counter(FAULT.findall(self.log())))

    def counters(self):
        """Return the counters of all attempts from the newest checkpoint; empty if no checkpoint exists."""
        found = [json.loads((it / "manifest.json").read_text()) for it in self.checkpoints()[-1:]]
        return found[0]["counters"] if found else {}

    def processes(self):
        """Return process id and command line, as words, of every process below the runner."""
        return list(below(self.process.pid))

    def pids(self, program, simulator=""):
        """Return the ids of a program's processes, or only of those that serve a given simulator."""
        return [
            pid
            for pid, words in self.processes()
            if any(word.endswith(program) for word in words[:4])
            and any(simulator in word for word in words)
            and (program == REAPER or not any(REAPER in word for word in words))
        ]

    def pid_of(self, program, simulator=""):
        """Return the id of a program's only process, or of the only one that serves a given simulator.

        The method waits while the simulator is recycled.
        """
        (pid,) = self.until(lambda: self.pids(program, simulator))
        return pid

    def trainer(self):
        """Wait for the trainer's process, and return its id."""
        return self.until(lambda: self.pids("palaestra-train"))[0]


@contextmanager
def running(job):
    """Yield a run of a job, started in a temporary folder."""
    with tempfile.TemporaryDirectory() as folder, LocalRun(Path(folder), job) as run:
        yield run


def below(ancestor):
    """Yield process id and command line, as words, of every process below `ancestor`."""
    table = {}
    for directory in Path("/proc").glob("[0-9]*"):
        try:
            parent = int((directory / "stat").read_text().rpartition(")")[2].split()[1])
            words = (directory / "cmdline").read_bytes().decode().split("\0")
        except OSError:
            continue
        table[int(directory.name)] = (parent, words)
    wanted = {ancestor}
    while wanted:
        wanted = {pid for pid, (parent, _) in table.items() if parent in wanted}
        yield from ((pid, table[pid][1]) for pid in wanted)


def is_running(pid):
    """Return whether a process exists and is not a zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (OSError, IndexError):
        return False


def left_of(pids):
    """Return those of `pids` that still run after `GONE_S` seconds."""
    give_up = time.monotonic() + GONE_S
    while any(map(is_running, pids)) and time.monotonic() < give_up:
        time.sleep(0.05)
    return [pid for pid in pids if is_running(pid)]


def send(pid, number):
    """Send a signal to a process, and return whether the process existed."""
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return False
    return True
