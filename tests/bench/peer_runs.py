"""Endless trainings of the same task with one stub: by Palaestra, and by programs of other libraries.

A `with` block starts a training. `revive` restarts a training that has ended, without a delay. A Job of
Kubernetes would wait 10 s before the second start, and longer before each later one.
"""

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.bench import sb3_program
from tests.bench.step_counter import StepCounter
from tests.local_run import REAPER, ROOT, LocalRun, below
from tests.soak.jobs import ANY_NUMBER, LITTLE_DQN, tiny_job

MOST_STEPS = 1_000_000
CHECKPOINT_STEPS = 500
DEADLINE_S = 240.0
LOOK_EVERY_S = 0.02


def job(restart):
    """Return a job that collects with one simulator and never evaluates."""
    return tiny_job(
        collect={"restart": restart, "recycle": {"afterResets": 0}},
        algorithm=LITTLE_DQN,
        steps=MOST_STEPS,
        evaluation={"everySteps": 0},
        checkpoint={"everySteps": CHECKPOINT_STEPS, "keep": 2},
    )


class Palaestra:
    """`palaestra run` of the job, whose trainer restarts the simulator within the restart budget.

    Args:
        folder: an empty folder.
        restart: the restart budget; with a limit of 0, the run ends when the simulator breaks.
    """

    def __init__(self, folder, restart=ANY_NUMBER):
        self._run = LocalRun(folder, job(restart))
        self.revivals = 0

    def __enter__(self):
        self._run.start()
        return self

    def __exit__(self, *_):
        self._run.stop()

    def revive(self):
        """Start the run again if it has ended."""
        if self._run.process.poll() is not None:
            self.revivals += 1
            self._run.start()

    def steps(self):
        """Return the number of steps; while no trainer responds, those of the newest checkpoint."""
        status = self._run.status()
        if status:
            return status["step"]
        return max((int(path.name) for path in self._run.checkpoints()), default=0)

    def simulators(self):
        """Return the process ids of the simulator."""
        return stubs(self._run.process.pid)


class Program:
    """A training program in a loop that starts it again when it ends.

    Args:
        folder: an empty folder, in which the program saves.
        module: the module of the program.
        python: the interpreter of the program.
    """

    def __init__(self, folder, module="tests.bench.sb3_program", python=sys.executable):
        self._folder = folder
        spec = folder / "spec.json"
        spec.write_text(json.dumps(job(ANY_NUMBER)["spec"]))
        self._command = [python, "-m", module, spec, folder]
        self._counter = StepCounter(folder)
        self.revivals = 0

    def __enter__(self):
        self._start()
        return self

    def __exit__(self, *_):
        self._end(signal.SIGTERM)

    def revive(self):
        """Start the program again if it has ended."""
        if self._process.poll() is not None:
            self._end(signal.SIGKILL)
            self.revivals += 1
            self._start()

    def steps(self):
        """Return the number of steps; after a start, those of the newest checkpoint until the first step."""
        return self._counter.value

    def simulators(self):
        """Return the process ids of the simulator."""
        return stubs(self._process.pid)

    def _start(self):
        self._counter.value = sb3_program.newest(self._folder) or 0
        self._process = subprocess.Popen(
            self._command,
            cwd=ROOT,
            env=os.environ | {"PYTHONPATH": str(ROOT)},  # the program's child processes import from ROOT
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def _end(self, number):
        """End the program and its worker processes, if some of them still run."""
        try:
            os.killpg(self._process.pid, number)
        except ProcessLookupError:
            return
        self._process.wait(DEADLINE_S)


def wait_for_steps(training, steps):
    """Wait until a training has made this many steps."""
    wait_until(lambda: training.steps() >= steps, training)


def wait_until(claim, training):
    """Wait until a claim is true, and revive the training meanwhile.

    Raises:
        TimeoutError: the claim did not become true.
    """
    before = training.steps()
    end = time.monotonic() + DEADLINE_S
    while not claim():
        training.revive()
        if time.monotonic() > end:
            steps = f"from step {before} to {training.steps()} with {training.revivals} new starts"
            raise TimeoutError(f"{type(training).__name__}: came {steps} within {DEADLINE_S:g} s")
        time.sleep(LOOK_EVERY_S)


def kill(training):
    """Kill the training's simulator, and return whether there was one."""
    found = training.simulators()
    for pid in found:
        os.kill(pid, signal.SIGKILL)
    return bool(found)


def stubs(ancestor):
    """Return the process ids of the stubs below a process."""
    return [
        pid
        for pid, words in below(ancestor)
        if any(word.endswith("palaestra-stub") for word in words[:2])
        and not any(REAPER in word for word in words)
    ]


def started_at_s(pid):
    """Return the time at which a process started, in seconds since the Unix epoch."""
    ticks = int(Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[19])
    age_s = time.clock_gettime(time.CLOCK_BOOTTIME) - ticks / os.sysconf("SC_CLK_TCK")
    return time.time() - age_s
