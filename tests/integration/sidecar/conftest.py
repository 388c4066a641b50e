"""Real sidecars with small programs as simulators. Every wait has a deadline."""

import contextlib
import http.client
import json
import re
import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest

from palaestra_protocol.control import SidecarState, SimulatorState
from palaestra_sim.sidecar.signals import EXIT_HUNG
from palaestra_sim.world import builtin
from tests import waiting

PROGRAM = str(Path(sys.executable).with_name("palaestra-sidecar"))
ADDRESSES = re.compile(r"^palaestra-sidecar: control=(\S+) health=(\S+)$")
DEADLINE_S = 20.0  # the work takes milliseconds, but the machine may be busy
ENDS = {0, EXIT_HUNG}  # exit codes after a signal: without or with its alarm
PACE_S = 0.005  # between two polls of a state without events


def eventually(seen, deadline_s=DEADLINE_S):
    """Return the first true value of `seen`; fail at the deadline."""
    return waiting.eventually(seen, deadline_s, PACE_S)


def processes_with(mark):
    """Return the processes with `mark` in their command line, without zombies."""
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if mark.encode() in (folder / "cmdline").read_bytes():
                found.add(int(folder.name))
    return found


def was_seen(state):
    """Return whether a sidecar knows that its simulator ran.

    The simulator itself may write that it runs before the sidecar knows it.
    """
    return state.pid is not None or state.state is not SidecarState.STARTING


class Sidecar:
    """A running sidecar; tests use its ports and read its lines."""

    def __init__(self, command) -> None:
        self.process = subprocess.Popen(
            command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, stdin=subprocess.DEVNULL
        )
        self.lines = []
        self._reader = threading.Thread(target=self._read, daemon=True)
        self._reader.start()
        addresses = ADDRESSES.match(eventually(lambda: self.lines)[0])
        assert addresses, self.lines
        self.control, self.health = addresses.groups()

    def _read(self):
        for line in self.process.stdout:
            self.lines.append(line.decode().rstrip("\n"))

    def ask(self, method, path, body=None, address=None):
        """Return status and text of a response, by default from the control port."""
        connection = http.client.HTTPConnection(address or self.control, timeout=DEADLINE_S)
        try:
            connection.request(method, path, None if body is None else json.dumps(body))
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        finally:
            connection.close()

    def request(self, path, body=None):
        """Return the state after an accepted request."""
        status, text = self.ask("POST", path, body or {})
        assert status == 200, text
        return SimulatorState.from_json(json.loads(text))

    @property
    def state(self):
        """Return the state that it reports for its simulator."""
        status, text = self.ask("GET", "/state")
        assert status == 200, text
        return SimulatorState.from_json(json.loads(text))

    def until(self, wanted, deadline_s=DEADLINE_S):
        """Return the state as soon as it is `wanted`."""

        def seen():
            state = self.state
            return state if state.state is wanted else None

        return eventually(seen, deadline_s)

    def until_said(self, text, times=1):
        """Return once it or its simulator has printed lines with `text`."""
        eventually(lambda: sum(text in line for line in list(self.lines)) >= times)

    def start(self):
        """Start the simulator, and return the state once it has printed `up` and is known to run."""
        ups = self.lines.count("up") + 1
        self.request("/start")
        eventually(lambda: self.lines.count("up") >= ups and was_seen(self.state))
        return self.state

    def end(self, number=signal.SIGTERM):
        """Send a signal, wait for the end and return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(DEADLINE_S)


@pytest.fixture
def world(tmp_path):
    """Return the path of an included world, which also marks all processes of the test."""
    path = tmp_path / "arena.wbt"
    path.write_bytes(builtin("arena"))
    return path


@pytest.fixture
def arguments(tmp_path, world):
    """Return a function that makes a sidecar's command line.

    Its simulator is a Python program as text, or a command line.
    """

    def make(program, *options, executable=PROGRAM):
        if isinstance(program, str):
            (tmp_path / "simulator.py").write_text(program)
            program = [sys.executable, "-I", "-S", "-u", str(tmp_path / "simulator.py")]
        return [
            *(executable, "--driver", "command", "--world", str(world)),
            *("--control", "127.0.0.1:0", "--health", "127.0.0.1:0", *options),
            *("--", *program, str(tmp_path)),
        ]

    return make


@pytest.fixture
def run_sidecar(tmp_path):
    """Yield a function that runs a sidecar's command line; at the end no process of it may exist."""
    running = []

    def run(command):
        running.append(Sidecar(command))
        return running[-1]

    yield run
    for each in running:
        if each.process.poll() is None:
            each.process.kill()
        each.process.wait(DEADLINE_S)
        each._reader.join(DEADLINE_S)
        each.process.stdout.close()
    eventually(lambda: not processes_with(str(tmp_path)))


@pytest.fixture
def sidecar(arguments, run_sidecar):
    """Return a function that runs a sidecar whose simulator is a program."""

    def run(program, *options, before=(), executable=PROGRAM):
        return run_sidecar([*before, *arguments(program, *options, executable=executable)])

    return run


@pytest.fixture
def left(tmp_path):
    """Return a function that returns the running processes of this test."""
    return lambda: processes_with(str(tmp_path))


@pytest.fixture
def eventually_true():
    """Return a function that waits for a condition, with a deadline."""
    return eventually


WAITS = """
import signal
print("up")
signal.pause()
"""

STUBBORN = """
import signal
for number in (signal.SIGTERM, signal.SIGINT, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN)
print("up")
while True:
    signal.pause()
"""

# This is like a launcher that starts a server, which starts workers: they have their own sessions and groups,
# no parent, no environment, and all of them ignore SIGTERM.
FAMILY = """
import os, signal, sys
signal.signal(signal.SIGTERM, signal.SIG_IGN)
def child(leave):
    ready, tell = os.pipe()
    if os.fork() == 0:
        if leave == "orphan" and os.fork():
            os._exit(0)
        os.set_inheritable(tell, True)
        if leave != "stay":
            os.setsid()
        program = f"import os, signal; os.write({tell}, b'x'); os.close({tell}); signal.pause()"
        os.execve(sys.executable, [sys.executable, "-I", "-S", "-c", program, sys.argv[1]], {})
    os.read(ready, 1)
for leave in ("stay", "setsid", "orphan"):
    child(leave)
print("up")
while True:
    signal.pause()
"""


@pytest.fixture
def waits():
    """Return a simulator that waits until a signal ends it."""
    return WAITS


@pytest.fixture
def stubborn():
    """Return a simulator that only SIGKILL ends."""
    return STUBBORN


@pytest.fixture
def family():
    """Return a simulator that has started three processes, two of which have left its session."""
    return FAMILY


@pytest.fixture
def ends():
    """Return a function that makes a simulator which prints `up` and runs one statement at its end."""
    return lambda statement: f"import os, signal, sys\nprint('up')\n{statement}\n"
