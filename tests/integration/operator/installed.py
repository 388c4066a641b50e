"""An operator as a process, with the rights of an installed one, and what it asked of the API server."""

import signal
import subprocess
import sys
import time
import urllib.request
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.error import URLError

from prometheus_client.parser import text_string_to_metric_families

from palaestra.local.ports import LOOPBACK, HeldPorts
from tests.control_plane.plane import ControlPlane

USER = "system:serviceaccount:palaestra-system:palaestra-operator"
PROGRAM = Path(sys.executable).with_name("palaestra")
READS = ("get", "list", "watch")
READY_S = 30
END_S = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """One request of the operator, from the API server's audit log."""

    verb: str
    resource: str
    name: str
    code: int

    @property
    def counts(self) -> bool:
        """Whether it is anything but a watch and the Lease."""
        return self.verb != "watch" and self.resource != "leases"


@dataclass(frozen=True, slots=True, kw_only=True)
class Installed:
    """A running operator."""

    plane: ControlPlane
    process: "subprocess.Popen[bytes]"
    port: int

    def rss_bytes(self) -> int:
        """Return its resident memory now."""
        lines = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmRSS:"))

    def requests(self) -> Counter[tuple[str, str]]:
        """Return how often it asked, by verb and resource, from its own metrics; no watch, no Lease."""
        with urllib.request.urlopen(f"http://127.0.0.1:{self.port}/metrics", timeout=10) as answer:
            families = list(text_string_to_metric_families(answer.read().decode()))
        return Counter(
            {
                (sample.labels["verb"], sample.labels["resource"]): round(sample.value)
                for family in families
                for sample in family.samples
                if sample.name == "palaestra_operator_requests_total"
                and sample.labels["verb"] != "watch"
                and sample.labels["resource"] != "leases"
            }
        )

    def end(self) -> float:
        """End it with SIGTERM and return the seconds that it took."""
        started = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(END_S)
        return time.monotonic() - started


def asked(plane: ControlPlane) -> list[Asked]:
    """Return all that any operator ever asked, watches and the Lease included, in order."""
    found = []
    for entry in plane.audit():
        if entry["user"].get("username") == USER and entry["stage"] == "ResponseComplete":
            what = entry.get("objectRef") or {}
            found.append(
                Asked(
                    verb=entry["verb"],
                    resource=what.get("resource", entry["requestURI"]),
                    name=what.get("name", ""),
                    code=entry["responseStatus"]["code"],
                )
            )
    return found


@contextmanager
def operator(plane: ControlPlane, log: Path) -> Iterator[Installed]:
    """Run an operator until the block ends; its log goes to a file."""
    with HeldPorts() as ports:
        port = ports.any()
        kubeconfig = str(plane.kubeconfig_of(USER))
        options = ("--kubeconfig", kubeconfig, "--metrics-address", f"{LOOPBACK}:{port}")
        with log.open("ab") as written:
            process = subprocess.Popen(
                ["setpriv", "--pdeathsig", "KILL", "--", str(PROGRAM), "operator", *options],
                stdin=subprocess.DEVNULL,
                stdout=written,
                stderr=subprocess.STDOUT,
            )
        running = Installed(plane=plane, process=process, port=port)
        try:
            wait_for(lambda: _ready(port), READY_S, lambda: log.read_text()[-3000:])
            yield running
        finally:
            process.kill()
            process.wait()


def wait_for(claim: Callable[[], bool], deadline_s: float, told: Callable[[], object]) -> None:
    """Wait until a claim holds; else fail with what is told."""
    ends = time.monotonic() + deadline_s
    while not claim():
        assert time.monotonic() < ends, f"not within {deadline_s} s: {told()}"
        time.sleep(0.5)  # an API server that is polled must have time for its work


def _ready(port: int) -> bool:
    with suppress(URLError, OSError):
        urllib.request.urlopen(f"http://127.0.0.1:{port}/readyz", timeout=2).close()
        return True
    return False
