"""Real sidecars with small programs as simulators; every wait has a timeout."""

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
DEADLINE_S = 20.0  # the waits take milliseconds on an idle machine
ENDS = {0, EXIT_HUNG}  # exit codes after a signal; on a busy machine, the alarm ends the sidecar
PACE_S = 0.005  # the pause between two polls of a state, because no event reports its changes


def eventually(seen, deadline_s=DEADLINE_S):
    """Return the first true value of `seen`; fail after the timeout."""
    return waiting.eventually(seen, deadline_s, PACE_S)


def processes_with(mark):
    """Return the ids of processes whose command line contains `mark`; a zombie's is empty."""
    found = set()
    for folder in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            if mark.encode() in (folder / "cmdline").read_bytes():
                found.add(int(folder.name))
    return found


def was_seen(state):
    """Return whether a sidecar has noticed that its simulator runs.

    The simulator may print `up` before the sidecar notices that.
    """
    return state.pid is not None or state.state is not SidecarState.STARTING


class Sidecar:
    """A running sidecar, whose ports and output a test uses."""

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
        """Return status and text of a response, by default of the control port."""
        connection = http.client.HTTPConnection(address or self.control, timeout=DEADLINE_S)
        try:
            connection.request(method, path, None if body is None else json.dumps(body))
            answer = connection.getresponse()
            return answer.status, answer.read().decode()
        finally:
            connection.close()

    def request(self, path, body=None):
        """Send a request that must be accepted, and return the new state."""
        status, text = self.ask("POST", path, body or {})
        assert status == 200, text
        return SimulatorState.from_json(json.loads(text))

    @property
    def state(self):
        """The state that the sidecar reports for its simulator."""
        status, text = self.ask("GET", "/state")
        assert status == 200, text
        return SimulatorState.from_json(json.loads(text))

    def until(self, wanted, deadline_s=DEADLINE_S):
        """Wait until the simulator is in the state `wanted`, and return the full state."""

        def seen():
            state = self.state
            return state if state.state is wanted else None

        return eventually(seen, deadline_s)

    def until_said(self, text, times=1):
        """Wait until the sidecar or its simulator has printed `text` this many times."""
        eventually(lambda: sum(text in line for line in list(self.lines)) >= times)

    def start(self):
        """Start the simulator, and return its state.

        The method waits until the simulator has printed `up` and the sidecar has noticed that it runs.
        """
        ups = self.lines.count("up") + 1
        self.request("/start")
        eventually(lambda: self.lines.count("up") >= ups and was_seen(self.state))
        return self.state

    def end(self, number=signal.SIGTERM):
        """Send a signal to the sidecar, wait for its end, and return the exit code."""
        self.process.send_signal(number)
        return self.process.wait(DEADLINE_S)


@pytest.fixture
def world(tmp_path):
    """Return the path of an included world; processes of the test have this path in their command line."""
    path = tmp_path / "arena.wbt"
    path.write_bytes(builtin("arena"))
    return path


@pytest.fixture
def arguments(tmp_path, world):
    """Return a function that returns the command line of a sidecar.

    The simulator is given as the text of a Python program, or as a command line.
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
    """Yield a function that starts a sidecar; at the end, no process of it may exist."""
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
    """Return a function that starts a sidecar with a program as its simulator."""

    def run(program, *options, before=(), executable=PROGRAM):
        return run_sidecar([*before, *arguments(program, *options, executable=executable)])

    return run


@pytest.fixture
def left(tmp_path):
    """Return a function that returns the ids of this test's running processes."""
    return lambda: processes_with(str(tmp_path))


@pytest.fixture
def eventually_true():
    """Return a function that waits for a true value, with a timeout."""
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

# This program acts like a launcher that starts a server, which starts workers. The processes have their own
# sessions and groups, no parent and no environment, and all of them ignore SIGTERM.
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
    """Return a simulator that waits for a signal."""
    return WAITS


@pytest.fixture
def stubborn():
    """Return a simulator that ends only by SIGKILL."""
    return STUBBORN


@pytest.fixture
def family():
    """Return a simulator with three child processes, two of which have left its session."""
    return FAMILY


@pytest.fixture
def ends():
    """Return a function that returns a simulator which prints `up` and then executes a statement."""
    return lambda statement: f"import os, signal, sys\nprint('up')\n{statement}\n"
