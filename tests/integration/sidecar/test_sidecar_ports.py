"""The responses of the sidecar's two ports, and the requests that they refuse."""

import re
import socket
import subprocess
from pathlib import Path

import pytest

from palaestra_protocol.control import SidecarState
from palaestra_sim.sidecar.reaper import children

BUSY = """
import os, signal, time
child = os.fork()
while time.process_time() < 0.2:
    pass
if not child:
    os._exit(0)
os.waitpid(child, 0)
print("up")
signal.pause()
"""


def raw(address, text):
    """Send bytes, which need not be HTTP, and return the first line of the response."""
    host, port = address.split(":")
    with socket.create_connection((host, int(port)), 10) as connection:
        connection.sendall(text)
        return connection.makefile("rb").readline().decode()


def test_health_answers_whatever_the_simulator_does(sidecar, ends) -> None:
    """The kubelet must not restart a healthy sidecar, because the trainer restarts a failed simulator."""
    it = sidecar(ends("sys.exit(1)"))
    it.request("/start")
    it.until(SidecarState.FAILED)

    assert it.ask("GET", "/healthz", address=it.health) == (200, "ok\n")


def test_a_driver_that_shows_nothing_says_so_on_both_ports(sidecar, waits) -> None:
    """A user who opens the view learns which drivers support it."""
    it = sidecar(waits)

    answers = {
        it.ask("GET", path, address=port)
        for path in ("/scene", "/watch", "/camera")
        for port in (it.control, it.health)
    }

    sentence = "driver command does not describe its world to viewers; use driver stub or mujoco"
    assert answers == {(404, f'{{"error": "{sentence}"}}\n')}


def test_both_ports_tell_the_same_state(sidecar, waits) -> None:
    """The trainer reads one port, and users and the operator read the other."""
    it = sidecar(waits)
    it.start()

    assert it.ask("GET", "/state", address=it.health) == it.ask("GET", "/state")


@pytest.mark.parametrize("path", ["/start", "/ready", "/stop"])
def test_the_health_port_takes_no_orders(sidecar, waits, path) -> None:
    """Every client that can reach the pod can use this port."""
    it = sidecar(waits)

    status, _ = it.ask("POST", path, {"deadline_s": 0}, it.health)

    assert status == 404
    assert it.state.starts == 0


def test_the_metrics_count_starts_faults_and_states(sidecar, ends) -> None:
    """All labels exist from the start, because Prometheus computes no rate for a new series."""
    it = sidecar(ends("os.kill(os.getpid(), signal.SIGBUS)"))
    it.request("/start")
    it.until(SidecarState.FAILED)

    _, text = it.ask("GET", "/metrics", address=it.health)

    values = dict(re.findall(r"^(palaestra_\S+) (\S+)$", text, re.MULTILINE))
    assert values.pop('palaestra_sidecar_build_info{version="0.1.0"}') == "1.0"
    assert {name.removeprefix("palaestra_simulator_"): float(value) for name, value in values.items()} == {
        'up{slot="a"}': 0,
        'starts_total{slot="a"}': 1,
        'unexpected_exits_total{kind="code",slot="a"}': 0,
        'unexpected_exits_total{kind="signal",slot="a"}': 1,
        'unexpected_exits_total{kind="unknown",slot="a"}': 0,
        'state{slot="a",state="idle"}': 0,
        'state{slot="a",state="starting"}': 0,
        'state{slot="a",state="ready"}': 0,
        'state{slot="a",state="stopping"}': 0,
        'state{slot="a",state="failed"}': 1,
        'rss_bytes{slot="a"}': 0,
        'cpu_seconds_total{slot="a"}': 0,
    }


def test_the_metrics_know_the_memory_of_the_whole_family(sidecar, family) -> None:
    """A launcher is small, but the processes that it starts are large."""
    it = sidecar(family)
    it.start()

    _, text = it.ask("GET", "/metrics", address=it.health)

    (rss,) = re.findall(r"^palaestra_simulator_rss_bytes{slot=\"a\"} (\S+)$", text, re.MULTILINE)
    assert 'palaestra_simulator_up{slot="a"} 1.0' in text
    assert float(rss) > 4 * 4e6  # more than four Python processes need at least


def test_the_metrics_know_the_processor_time_of_the_whole_family(sidecar) -> None:
    """The kernel adds the time of ended processes to their parent, so the sum must include it."""
    it = sidecar(BUSY)
    it.start()

    _, text = it.ask("GET", "/metrics", address=it.health)

    (used,) = re.findall(r"^palaestra_simulator_cpu_seconds_total{slot=\"a\"} (\S+)$", text, re.MULTILINE)
    assert 0.35 < float(used) < 1.0  # two processes used 0.2 s each, counted in ticks of 0.01 s


@pytest.mark.parametrize(
    ("body", "error"),
    [
        ({"deadline": 1}, "deadline: is not a field of this request"),
        ({}, "deadline_s: is missing"),
        ([], "body: a list is not an object"),
        ({"deadline_s": -1}, "deadline_s: is not between 0 and 3600"),
    ],
)
def test_a_wrong_body_is_named_and_changes_nothing(sidecar, waits, body, error) -> None:
    """With status 400, no client takes the error for a refusal by the current state."""
    it = sidecar(waits)
    it.start()

    status, text = it.ask("POST", "/stop", body)

    assert (status, text) == (400, f'{{"error": "{error}"}}\n')
    assert it.state.state is SidecarState.STARTING


@pytest.mark.parametrize(
    ("request_", "status"),
    [
        (b"POST /start HTTP/1.1\r\n\r\n", 411),
        (b"POST /start HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n", 411),
        (b"POST /start HTTP/1.1\r\nContent-Length: 4097\r\n\r\n", 413),
        (b"POST /start HTTP/1.1\r\nContent-Length: " + b"9" * 5000 + b"\r\n\r\n", 413),
        (b"POST /start HTTP/1.1\r\nContent-Length: -1\r\n\r\n", 411),
        (b"POST /start HTTP/1.1\r\nContent-Length: 1\r\n\r\n[", 400),
        (b"GET /start HTTP/1.1\r\n\r\n", 405),
        (b"GET /etc/passwd HTTP/1.1\r\n\r\n", 404),
        (b"DELETE /start HTTP/1.1\r\n\r\n", 501),
        (b"GET /" + b"x" * 70_000 + b" HTTP/1.1\r\n\r\n", 414),
    ],
)
def test_a_request_of_the_wrong_size_or_kind_is_refused(sidecar, waits, request_, status) -> None:
    """The sidecar must not read or execute more than a valid request."""
    it = sidecar(waits)

    assert raw(it.control, request_).split()[1] == str(status)
    assert it.state.starts == 0


def test_many_silent_connections_do_not_take_the_port_away(sidecar, waits, eventually_true) -> None:
    """The sidecar closes connections beyond its limit, and the others time out."""
    it = sidecar(waits)
    host, port = it.health.split(":")
    silent = [socket.create_connection((host, int(port)), 10) for _ in range(60)]

    def answers():
        try:
            return it.ask("GET", "/healthz", address=it.health)[0] == 200
        except OSError:
            return False

    eventually_true(answers, 15)
    for connection in silent:
        connection.close()


def test_a_port_in_use_is_one_clear_line_and_nothing_is_started(sidecar, arguments, waits) -> None:
    """A second attempt cannot help, so the exit code is 2."""
    taken = sidecar(waits).control

    second = subprocess.run(
        arguments(waits, "--control", taken), capture_output=True, text=True, timeout=20, check=False
    )

    assert (second.returncode, second.stdout) == (2, "")
    assert second.stderr == (
        f"palaestra-sidecar: --control: {taken}: Address already in use; choose another port, or 0 for a "
        "free port\n"
    )


def test_a_sidecar_is_small(sidecar, family) -> None:
    """Sidecar and reaper need less than 40 MB, so that a laptop or a node can run many."""
    it = sidecar(family)
    it.start()
    it.ask("GET", "/metrics", address=it.health)
    own = {it.process.pid} | children({it.process.pid})

    pages = [int(Path(f"/proc/{pid}/statm").read_text().split()[1]) for pid in own]

    assert sum(pages) * 4096 < 40e6
