"""The effect of a viewer on a simulator's steps: equal rounds with and without a viewer, in turns."""

import os
import select
import statistics
import subprocess
import sys
import time
from contextlib import contextmanager
from http.client import HTTPConnection

from palaestra_protocol.fields import decoded
from palaestra_protocol.scene import SceneState
from tests.bench.arena import running
from tests.bench.sizes import scaled
from tests.local_run import ROOT

ROUNDS = 60  # many short rounds, because the load of the machine varies
STEPS = 400
PER_SECOND = 30.0  # the rate at which the page requests scenes


def measure(scale=1.0):
    """Return the steps per second with and without a viewer, and the median of the rounds' ratios."""
    with running() as (robot, _, launcher), viewing(launcher.address.removeprefix("http://")) as viewer:
        robot.connect()
        pairs = [(stepped(robot, STEPS), watched(robot, STEPS, viewer)) for _ in range(scaled(ROUNDS, scale))]
        robot.close()
    return {
        "steps_per_second": round(statistics.median(alone for alone, _ in pairs)),
        "watched_steps_per_second": round(statistics.median(seen for _, seen in pairs)),
        "watched_share": round(statistics.median(seen / alone for alone, seen in pairs), 3),
    }


@contextmanager
def viewing(address):
    """Start a viewer and yield it; like a page, it is a separate process.

    The viewer requests scenes only between the commands `1` and `0`.
    """
    command = [sys.executable, "-m", "tests.bench.watched", address]
    with subprocess.Popen(command, cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as viewer:
        viewer.stdout.readline()  # the viewer has started
        yield viewer
        viewer.stdin.close()
        if viewer.wait(30.0):
            raise RuntimeError("the viewer failed")


def watched(robot, steps, viewer):
    """Return the steps per second of a robot while a viewer watches it."""
    os.write(viewer.stdin.fileno(), b"1")
    try:
        return stepped(robot, steps)
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


def watch(address):
    """Between the commands `1` and `0`, request the newest state as often as a page does.

    The function returns when standard input closes.
    """
    sys.stdout.write("watches\n")
    sys.stdout.flush()
    asks = False
    while True:
        if select.select([sys.stdin], [], [], 1.0 / PER_SECOND if asks else None)[0]:
            told = os.read(sys.stdin.fileno(), 1)
            if not told:
                return
            asks = told == b"1"
        if asks:
            connection = HTTPConnection(address, timeout=10.0)
            connection.request("GET", "/watch")
            SceneState.from_json(decoded(connection.getresponse().read()))
            connection.close()


if __name__ == "__main__":
    watch(sys.argv[1])
