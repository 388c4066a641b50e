"""How long a robot still moves after its program was killed, its network was cut, or its policy hangs.

The mock robot runs in real time, because a faster one would measure this machine's scheduler.
"""

import contextlib
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

from tests.mock_robots import Cable, ended, started

DRIVING = Path(__file__).parent / "integration" / "real_robots" / "driving.py"
LIMITS_S = {"kill": 0.35, "cut": 0.35, "hang": 0.6, "kill, over ros1": 0.4, "hang, over ros1": 0.6}
STANDS_WITHIN_S = 20.0  # measured by this machine's clock, because the robot's clock may be late


def standing_s(client, begin_s=0.0, *, commands=True):
    """Wait until the robot stands, and return the robot's seconds until then.

    The seconds begin at the last command, but not before `begin_s`. If `commands` is False, they begin at
    `begin_s`, because a program whose policy hangs still sends commands of zero. The robot stands when its
    true velocity stays below 0.01 m/s for at least 0.3 s of the robot's time.
    """
    since, deadline = None, time.monotonic() + STANDS_WITHIN_S
    while time.monotonic() < deadline:
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
    """Yield a program that drives the robot at `url`; `then` is the action of its policy after some steps."""
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
    """Return the robot's seconds until it stands after the event `what`, a key of `LIMITS_S`.

    If the policy hangs, the seconds begin at its last action, otherwise at the robot's last command.
    """
    with (
        robot(over_ros="ros" in what) as (address, client, cut),
        driver(address, then="hang" if "hang" in what else "go") as program,
    ):
        if "hang" in what:
            return standing_s(client, client.get("/mock/truth")["time_s"], commands=False)
        if "cut" in what:
            cut()
        else:
            program.send_signal(signal.SIGKILL)
        return standing_s(client)


@contextlib.contextmanager
def robot(*, over_ros):
    """Yield the address of a mock robot, a client that sees its truth, and a function that cuts its network.

    The network of a robot with the ROS driver cannot be cut here; `tests.cut_network` cuts it.
    """
    with contextlib.ExitStack() as stack:
        master = stack.enter_context(ros_master()) if over_ros else None
        options = ("--ros1", "--max-speed=0.5") if over_ros else ()
        process, client = started("--drift=0", *options, **({"ROS_MASTER_URI": master} if master else {}))
        stack.callback(ended, process, client)
        if master is not None:
            yield master.replace("http://", "ros1://").rstrip("/"), client, None
        else:
            cable = stack.enter_context(Cable(client))
            yield cable.url, client, cable.cut


@contextlib.contextmanager
def ros_master(listen="127.0.0.1:0"):
    """Yield the address of a new ROS master."""
    program = [sys.executable, "-m", "palaestra_trainer.ros_master", "--listen", listen]
    master = subprocess.Popen(program, stdout=subprocess.PIPE, text=True)
    try:
        yield re.search(r"http://\S+", master.stdout.readline())[0]
    finally:
        master.kill()
        master.communicate()
