"""The effect of a viewer on the steps of a simulator and of a training: rounds with and without a viewer.

On a busy machine, the steps per second vary more than a viewer changes them. So the processor time that the
viewer's requests cost the programs of the training is measured too.
"""

import os
import select
import statistics
import subprocess
import sys
import time
from contextlib import contextmanager
from pathlib import Path
from urllib.parse import urlsplit

from palaestra.live_view.local_run import LocalRun
from palaestra.live_view.source import SidecarSource, at_address
from tests import local_run
from tests.bench.arena import running
from tests.bench.sizes import scaled
from tests.jobs import example

ROUNDS = 60  # many short rounds, so that changes of the machine's load average out
STEPS = 400
TRAINING_ROUNDS = 20
TRAINING_S = 4.0
WARM_STEPS = 1500  # after these steps the policy learns, so the measured steps include learning
MOST_STEPS = 1_000_000
PATIENCE_S = 180
PERIOD_S = 1.0 / 20.0  # the page requests the scene 20 times per second
PROGRAMS = ("palaestra-train", "palaestra-sidecar", "palaestra-stub")
TICKS_PER_S = os.sysconf("SC_CLK_TCK")


def measure(scale=1.0):
    """Return the share of the steps per second that remains with a viewer, for a simulator and a training."""
    return {**measure_simulator(scale), **measure_training(scale)}


def measure_simulator(scale=1.0):
    """Return the steps per second of a simulator alone, which steps as fast as it can."""
    with running() as (robot, _, launcher), viewing(launcher.address) as viewer:
        robot.connect()
        pairs = compared(scaled(ROUNDS, scale), viewer, lambda: stepped(robot, STEPS))
        robot.close()
    return medians(pairs)


def measure_training(scale=1.0):
    """Return the steps per second of a training, which also learns, and the cost of watching it.

    `training_processor_share` is the processor time that a second of watching costs trainer, sidecar and
    simulator together, in seconds.
    """
    job = example("move-to-target")
    job["spec"]["trainer"] |= {"steps": MOST_STEPS, "evaluation": {"everySteps": 0}}
    with local_run.running(job) as run:
        run.wait_for_step(scaled(WARM_STEPS, scale), PATIENCE_S)
        pids = [pid for program in PROGRAMS for pid in run.pids(program)]
        with viewing(run.directory) as viewer:
            samples = compared(scaled(TRAINING_ROUNDS, scale), viewer, lambda: trained(run, TRAINING_S, pids))
    found = medians([(alone[0], seen[0]) for alone, seen in samples])
    found["processor_share"] = round(statistics.median(_extra(*pair) for pair in samples), 4)
    return {f"training_{name}": value for name, value in found.items()}


def _extra(alone, seen):
    """Return the processor seconds per second that a viewer adds to the cost of the steps in its round."""
    (speed, busy), (seen_speed, seen_busy) = alone, seen
    return seen_busy - busy / speed * seen_speed


def compared(rounds, viewer, measured):
    """Return pairs of results of `measured`: without the viewer, and with it.

    Each second round begins with the viewer, so a load that grows or shrinks cancels out.
    """
    pairs = []
    for number in range(rounds):
        order = (False, True) if number % 2 else (True, False)
        found = {seen: watched(viewer, measured) if seen else measured() for seen in order}
        pairs.append((found[False], found[True]))
    return pairs


def medians(pairs):
    """Return the medians of the speeds without and with the viewer, and the median of the rounds' ratios."""
    return {
        "steps_per_second": round(statistics.median(alone for alone, _ in pairs)),
        "watched_steps_per_second": round(statistics.median(seen for _, seen in pairs)),
        "watched_share": round(statistics.median(seen / alone for alone, seen in pairs), 3),
        "rounds": len(pairs),
    }


@contextmanager
def viewing(what):
    """Start a viewer of a run directory or of a sidecar's address, and yield it.

    Like a page, the viewer is a separate process. It sends requests only between the commands `1` and `0`.
    """
    command = [sys.executable, "-m", "tests.bench.watched", what]
    with subprocess.Popen(
        command, cwd=local_run.ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE
    ) as viewer:
        viewer.stdout.readline()  # wait until the viewer has started
        yield viewer
        viewer.stdin.close()
        if viewer.wait(30.0):
            raise RuntimeError("the viewer failed")


def watched(viewer, measured):
    """Return the result of `measured` while the viewer watches."""
    os.write(viewer.stdin.fileno(), b"1")
    try:
        return measured()
    finally:
        os.write(viewer.stdin.fileno(), b"0")


def stepped(robot, steps):
    """Return the steps per second of a robot that turns back and forth."""
    started = time.perf_counter()
    for number in range(steps):
        way = 1.0 if number % 2 else -1.0
        robot.drive(way * 0.3, way * 0.1, way * 0.5)
        robot.advance()
    return steps / (time.perf_counter() - started)


def trained(run, seconds, pids):
    """Return the steps per second of a training during some seconds, and the processor time per second."""
    first, used, started = run.ask()["step"], processor_s(pids), time.perf_counter()
    time.sleep(seconds)
    last, passed = run.ask()["step"], time.perf_counter() - started
    return (last - first) / passed, (processor_s(pids) - used) / passed


def processor_s(pids):
    """Return the processor time of processes, in seconds."""
    fields = (Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split() for pid in pids)
    return sum(int(user) + int(system) for user, system in (each[11:13] for each in fields)) / TICKS_PER_S


def source_of(what):
    """Return the first simulator of a run directory, or the simulator of a sidecar's address."""
    if Path(what).is_dir():
        return LocalRun(Path(what)).sources()[0]
    parts = urlsplit(what)
    return SidecarSource(name=what, fetch=at_address(parts.hostname, parts.port))


def watch(source):
    """Between the commands `1` and `0`, send the requests of a page, as often as a page does.

    The function returns when standard input closes.
    """
    sys.stdout.write("watches\n")
    sys.stdout.flush()
    asks, due = False, 0.0
    while True:
        left = max(0.0, due - time.monotonic()) if asks else None
        if select.select([sys.stdin], [], [], left)[0]:
            told = os.read(sys.stdin.fileno(), 1)
            if not told:
                return
            asks = told == b"1"
        elif asks:
            due = time.monotonic() + PERIOD_S
            source.state()
            source.progress()


if __name__ == "__main__":
    watch(source_of(sys.argv[1]))
