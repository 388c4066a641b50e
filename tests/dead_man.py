"""How long a robot still moves after its program was killed, its network was cut, or its policy hangs.

The mock robot runs in real time, because a faster one would measure this machine's scheduler.
"""

import contextlib
import signal
import subprocess
import sys
from pathlib import Path

from tests.mock_robots import Cable, ended, started

DRIVING = Path(__file__).parent / "integration" / "real_robots" / "driving.py"
LIMITS_S = {"kill": 0.35, "cut": 0.35, "hang": 0.6}


def standing_s(client, begin_s=0.0, *, commands=True):
    """Wait until the robot stands, and return its time since `begin_s`, or since its last command if later.

    Without `commands`, a later command does not count: a program whose policy hangs commands zero.

    The true velocity is below 0.01 m/s from then on for at least 0.3 s of the robot's time.
    """
    since = None
    for _ in range(10_000):
        now = client.get("/mock/truth")
        if max(abs(now["vx"]), abs(now["vy"])) >= 0.01:
            since = None
        elif since is None:
            since = now["time_s"]
        elif now["time_s"] - since >= 0.3:
            return since - max(begin_s, (now["last_command_s"] or 0.0) if commands else 0.0)
    raise AssertionError(f"the robot does not stop: {now}")


@contextlib.contextmanager
def driver(url, speed=1.0, then="go"):
    """Yield a program that drives the robot at `url`; `then`: what its policy does after some steps."""
    arguments = [sys.executable, DRIVING, url, str(speed), then]
    program = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
    try:
        while (line := program.stdout.readline()) != "driving\n":
            assert line, "the program ended before it drove"
        yield program
    finally:
        program.kill()
        program.communicate()


def after(what):
    """Return the robot's seconds from its last command, or from the last action, until it stands.

    `what` is `kill`, `cut` or `hang`.
    """
    robot, client = started("--drift=0")
    try:
        with Cable(client) as cable, driver(cable.url, then="hang" if what == "hang" else "go") as program:
            if what == "hang":
                return standing_s(client, client.get("/mock/truth")["time_s"], commands=False)
            if what == "cut":
                cable.cut()
            else:
                program.send_signal(signal.SIGKILL)
            return standing_s(client)
    finally:
        ended(robot, client)
