"""An operator as a process with an installation's permissions, and its requests to the API server."""

import os
import re
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

ROOT = Path(__file__).parents[3]
USER = "system:serviceaccount:palaestra-system:palaestra-operator"
PROGRAM = Path(sys.executable).with_name("palaestra")
READS = ("get", "list", "watch")
READY_S = 120  # a start takes 2 s on an idle machine
END_S = 10


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """One request of an operator, from the API server's audit log."""

    verb: str
    resource: str
    name: str
    code: int

    @property
    def counts(self) -> bool:
        """Return whether the request is neither a watch nor for the Lease."""
        return self.verb != "watch" and self.resource != "leases"


@dataclass(frozen=True, slots=True, kw_only=True)
class Installed:
    """A running operator."""

    plane: ControlPlane
    process: "subprocess.Popen[bytes]"
    port: int

    def rss_bytes(self) -> int:
        """Return the current resident memory of the process in bytes."""
        lines = Path(f"/proc/{self.process.pid}/status").read_text().splitlines()
        return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmRSS:"))

    def requests(self) -> Counter[tuple[str, str]]:
        """Return the number of requests by verb and resource, from the operator's own metrics.

        Watches and requests for the Lease are excluded.
        """
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
        """End the operator with SIGTERM, and return the seconds until its end."""
        started = time.monotonic()
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(END_S)
        return time.monotonic() - started


def asked(plane: ControlPlane) -> list[Asked]:
    """Return all requests of all operators in order, including watches and requests for the Lease."""
    found = []
    for entry in plane.audit(USER):
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
def operator(plane: ControlPlane, log: Path, *, in_a_pod: bool = False) -> Iterator[Installed]:
    """Run an operator until the block ends, with its log in a file.

    By default the operator has a kubeconfig. With `in_a_pod`, it has the files of a service account and the
    environment of its image instead.
    """
    with HeldPorts() as ports:
        port = ports.any()
        program = _in_a_pod(plane) if in_a_pod else (str(PROGRAM), "operator", *_kubeconfig(plane))
        with log.open("ab") as written:
            process = subprocess.Popen(
                ["setpriv", "--pdeathsig", "KILL", "--", *program, f"--metrics-address={LOOPBACK}:{port}"],
                env=os.environ | _environment(plane) if in_a_pod else None,
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


def _kubeconfig(plane: ControlPlane) -> tuple[str, str]:
    return "--kubeconfig", str(plane.kubeconfig_of(USER))


def _in_a_pod(plane: ControlPlane) -> tuple[str, ...]:
    """Return the command of an operator with the files of a pod's service account."""
    account = plane.folder / "account"
    account.mkdir(exist_ok=True)
    *_, namespace, name = USER.split(":")
    token = plane.kubectl("create", "token", name, f"--namespace={namespace}")
    assert token.returncode == 0, token.stderr
    (account / "token").write_text(token.stdout.strip())
    (account / "ca.crt").write_bytes(plane.authority.pair.certificate.read_bytes())
    return sys.executable, str(Path(__file__).with_name("in_a_pod.py")), str(account), "operator"


def _environment(plane: ControlPlane) -> dict[str, str]:
    """Return the variables that the image and a kubelet set.

    With them, the operator does not find the kubeconfig of the person who runs the tests.
    """
    lines = re.findall(r"^ENV (.+)$", (ROOT / "operator" / "Dockerfile").read_text(), re.MULTILINE)
    of_image = dict(word.split("=", 1) for line in lines for word in line.split())
    there = {"KUBERNETES_SERVICE_HOST": LOOPBACK, "KUBERNETES_SERVICE_PORT": str(plane.port)}
    return {**of_image, **there, "HOME": str(plane.folder), "KUBECONFIG": ""}


def wait_for(claim: Callable[[], bool], deadline_s: float, told: Callable[[], object]) -> None:
    """Wait until a claim is true; after the deadline, fail with the result of `told`."""
    ends = time.monotonic() + deadline_s
    while not claim():
        assert time.monotonic() < ends, f"not within {deadline_s} s: {told()}"
        time.sleep(0.5)  # a shorter pause would load the API server


def _ready(port: int) -> bool:
    with suppress(URLError, OSError):
        urllib.request.urlopen(f"http://127.0.0.1:{port}/readyz", timeout=2).close()
        return True
    return False
