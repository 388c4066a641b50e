"""`palaestra run` as a person types it, with what tests and measurements ask of it.

Everything is real: ROS master, sidecars, stubs and trainer, each a process of this machine. Tests
use only what a person could use: the run directory, `/status`, and the table of processes.
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
PATIENCE_S = 240.0  # of runs that take seconds on an idle machine; below pytest's deadline
REAPER = "reaper.py"  # its command line has that of the simulator in it
GONE_S = 10.0  # for the kernel to end what was killed
LOOK_EVERY_S = 0.05  # what is looked at, the run and all processes of the machine, costs processor time
FAULT = re.compile(r"simulator fault .*kind=(\w+)")
STATUS_ADDRESS = re.compile(r"^statusAddress: (\S+)$", re.MULTILINE)


class LocalRun:
    """One `palaestra run` of a job, and its directory; as a context it is ended with the block.

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
        """Start it."""
        return self.start()

    def __exit__(self, *_):
        """End it if it has not ended by itself."""
        self.stop()

    def start(self, *options):
        """Start it, again if it has ended; its output is kept until the next start.

        It ends with the thread that starts it, however that ends.
        """
        command = ["setpriv", "--pdeathsig=TERM", PALAESTRA, "run", self.file, "--dir", self.runs, *options]
        with self._output.open("w") as output:
            self.process = subprocess.Popen(command, stdout=output, stderr=subprocess.STDOUT)
        return self

    def end(self, within_s=PATIENCE_S):
        """Wait for its end; return exit code and output."""
        return self.process.wait(within_s), self.output()

    def stop(self):
        """Interrupt it as Ctrl-C does, and wait; nothing happens to one that has ended."""
        if self.process and self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
            self.process.wait(PATIENCE_S)

    def output(self):
        """Return what it has printed."""
        return self._output.read_text()

    def until(self, claim, within_s=PATIENCE_S, look_every_s=LOOK_EVERY_S):
        """Return the first true value of `claim`.

        Raises:
            AssertionError: there was none in time, or before the runner's end.
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
        """Return what the trainer's /status says, None while nobody answers."""
        try:
            found = STATUS_ADDRESS.search((self.directory / "training.yaml").read_text())
            with urllib.request.urlopen(f"http://{found[1]}/status", timeout=5) as answer:
                return json.load(answer)
        except (OSError, ValueError):
            return None

    def ask(self):
        """Return what /status says, asking until it is answered."""
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
        """Return how the run ended."""
        return json.loads((self.directory / "summary.json").read_text())

    def lines(self, name):
        """Return the JSON lines of a file of the run directory, none while it is not there."""
        path = self.directory / name
        return whole_lines(path) if path.exists() else []

    def attempts(self):
        """Return why each attempt began, e.g. `resumed at step 400`."""
        return [line["reason"] for line in self.lines("attempts.jsonl")]

    def checkpoints(self):
        """Return the folders of its checkpoints, the newest last."""
        found = (
            it for it in (self.directory / "checkpoints").glob("[0-9]*") if (it / "manifest.json").exists()
        )
        return sorted(found, key=lambda path: int(path.name))

    def log(self, container="trainer"):
        """Return the log of a container, empty before it has one."""
        path = self.directory / "logs" / f"{container}.log"
        return path.read_text(errors="replace") if path.exists() else ""

    def faults(self):
        """Return how many faults of each kind are in the trainer's log."""
        return dict(Counter(FAULT.findall(self.log())))

    def counters(self):
        """Return what is counted over all attempts, by the newest checkpoint; empty without one."""
        found = [json.loads((it / "manifest.json").read_text()) for it in self.checkpoints()[-1:]]
        return found[0]["counters"] if found else {}

    def processes(self):
        """Return pid and words of the command line of everything below the runner."""
        return list(below(self.process.pid))

    def pids(self, program, simulator=""):
        """Return the processes of a program, of those that serve one simulator if it is named."""
        return [
            pid
            for pid, words in self.processes()
            if any(word.endswith(program) for word in words[:4])
            and any(simulator in word for word in words)
            and (program == REAPER or not any(REAPER in word for word in words))
        ]

    def pid_of(self, program, simulator=""):
        """Return the one process of a program, that serves one simulator if it is named.

        A simulator that is recycled just now is waited for.
        """
        (pid,) = self.until(lambda: self.pids(program, simulator))
        return pid

    def trainer(self):
        """Return the trainer's process, waiting until there is one."""
        return self.until(lambda: self.pids("palaestra-train"))[0]


@contextmanager
def running(job):
    """Yield a run of a job, started in a folder of its own, which is taken away with it."""
    with tempfile.TemporaryDirectory() as folder, LocalRun(Path(folder), job) as run:
        yield run


def below(ancestor):
    """Yield pid and words of the command line of every process below `ancestor`."""
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
    """Return whether a process is there and no zombie."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except (OSError, IndexError):
        return False


def left_of(pids):
    """Return those processes that do not end in time."""
    give_up = time.monotonic() + GONE_S
    while any(map(is_running, pids)) and time.monotonic() < give_up:
        time.sleep(0.05)
    return [pid for pid in pids if is_running(pid)]


def send(pid, number):
    """Send a signal to a process, which may have ended by now; return whether it was there."""
    try:
        os.kill(pid, number)
    except ProcessLookupError:
        return False
    return True
