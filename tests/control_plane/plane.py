"""A control plane without nodes: etcd, kube-apiserver and kube-controller-manager as processes.

It starts in seconds and behaves like a cluster that runs no pods: it validates, stores and watches objects,
collects garbage, and creates the pods of Jobs. All its programs listen and connect only on the loopback
interface. The processes end with their parent process, even after SIGKILL (pdeathsig).
"""

import json
import os
import shutil
import ssl
import subprocess
import threading
import time
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from urllib.error import URLError

from palaestra.local.ports import LOOPBACK, HeldPorts
from tests.control_plane.certificates import Authority, Pair
from tests.control_plane.programs import programs
from tests.json_lines import whole_lines
from tests.waiting import eventually

ADDRESS = LOOPBACK
SERVICES = "198.19.0.0/24"  # a range for benchmarks, which no network routes
# No test needs the other controllers; each of them would watch a few kinds and send requests.
CONTROLLERS = (
    "job-controller",
    "garbage-collector-controller",
    "namespace-controller",
    "serviceaccount-controller",  # without a service account, a namespace accepts no pods
    "resourcequota-controller",
    "clusterrole-aggregation-controller",  # adds other kinds to `edit` and `view`
    "persistentvolumeclaim-protection-controller",  # releases claims that the API server protects
)
START_DEADLINE_S = 60
STOP_DEADLINE_S = 10
# Go's garbage collection runs rarely, because it would take a tenth of the processor time of these programs.
# Most of them run only for minutes, so their memory stays small enough. With thousands of jobs, the limit
# makes it run more often.
RARELY = {"GOGC": "400", "GOMEMLIMIT": "10GiB"}
AUDIT_MIB = 100_000  # at 100 MiB, the default, a new file begins, and readers would miss earlier requests
AUDIT = {
    "apiVersion": "audit.k8s.io/v1",
    "kind": "Policy",
    "omitStages": ["RequestReceived"],
    "rules": [
        # For Secrets, the log contains responses too: a request does not show whether it reads their content.
        {
            "level": "RequestResponse",
            "userGroups": ["system:serviceaccounts"],
            "resources": [{"group": "", "resources": ["secrets"]}],
        },
        {"level": "Metadata"},
    ],
}


class DidNotStart(Exception):
    """A program of the control plane ended, or was not ready in time; the message ends with its log."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ControlPlane:
    """A running control plane.

    Attributes:
        folder: certificates, logs and data; the caller created the folder and removes it.
        port: the port of the API server on 127.0.0.1.
        authority: signs the certificates of clients.
        kubeconfig: the kubeconfig of an administrator.
        binaries: the folder of the programs.
        clients: the folder for users' certificates and kubeconfigs; each process that uses the control plane
        has a folder of its own.
    """

    folder: Path
    port: int
    authority: Authority
    kubeconfig: Path
    binaries: Path
    clients: Path

    @property
    def server(self) -> str:
        """The API server's address."""
        return f"https://{ADDRESS}:{self.port}"

    @property
    def audit_log(self) -> Path:
        """The audit log: one line of JSON for each request, with user, verb and object."""
        return self.folder / "audit.log"

    def audit(self, about: str = "") -> list[dict[str, Any]]:
        """Return the logged requests in order, without an incomplete last line.

        Args:
            about: returns only entries that contain this text, e.g. a namespace, because all tests share the
            log.
        """
        return whole_lines(self.audit_log, about)

    def kubectl(self, *arguments: str, sent: str = "") -> "subprocess.CompletedProcess[str]":
        """Run kubectl as the administrator, with `sent` as standard input; the timeout is 60 s."""
        return subprocess.run(
            [str(self.binaries / "kubectl"), f"--cache-dir={self.folder / 'cache'}", *arguments],
            env={"KUBECONFIG": str(self.kubeconfig)},
            input=sent,
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )

    def await_kinds(self, *kinds: str) -> None:
        """Wait until CustomResourceDefinitions, named as for kubectl, are established and discovered.

        `kubectl wait` fails at once while a definition has no condition. kubectl also caches a discovery
        without the definition for hours, and `kubectl get CATEGORY` uses this cache; `kubectl api-resources`
        refreshes it.

        Raises:
            TooLate: a definition is not ready within 30 s.
        """
        wait = ("wait", "--for=condition=Established", "--timeout=10s", *kinds)
        eventually(lambda: self.kubectl(*wait).returncode == 0)
        listed = self.kubectl("get", "--output=name", *kinds).stdout.split()
        names = {each.partition("/")[2] for each in listed}
        eventually(lambda: names <= set(self.kubectl("api-resources", "--output=name").stdout.split()))

    def kubeconfig_of(self, user: str, group: str = "") -> Path:
        """Write a kubeconfig for a user with a certificate, and return its path."""
        return _kubeconfig(self.clients / f"{user.replace(':', '-')}.kubeconfig", self, user, group)


@contextmanager
def running(
    folder: Path, *, kinds: Path | None = None, requests_per_s: int | None = None
) -> Iterator[ControlPlane]:
    """Run a control plane with its files in `folder` until the block ends.

    Args:
        folder: an existing empty folder.
        kinds: a file of definitions that exist before the controllers start, because the garbage collector
        looks for new kinds only every 30 s.
        requests_per_s: the request rate of each controller; None means the default of Kubernetes.

    Raises:
        NoPrograms: the programs are not built.
        DidNotStart: a program was not ready within 60 s, or the API server refused the definitions.
        TooLate: the API server does not serve the definitions within 30 s.
    """
    authority = Authority.create(folder)
    with ExitStack() as processes:
        ports = processes.enter_context(HeldPorts())
        plane = ControlPlane(
            folder=folder,
            port=ports.any(),
            authority=authority,
            kubeconfig=folder / "kubeconfig",
            binaries=programs(),
            clients=folder,
        )
        _kubeconfig(plane.kubeconfig, plane, "admin", "system:masters")
        etcd_port = ports.any()
        processes.enter_context(started(folder, _etcd(plane, etcd_port, ports.any())))
        api_server = processes.enter_context(started(folder, _api_server(plane, etcd_port)))
        _wait_ready(plane, api_server)
        if kinds is not None:
            _define(plane, kinds)
        processes.enter_context(started(folder, _controllers(plane, requests_per_s)))
        yield plane


def _define(plane: ControlPlane, kinds: Path) -> None:
    file = f"--filename={kinds}"
    done = plane.kubectl("apply", "--server-side", file)
    if done.returncode:
        raise DidNotStart(f"{kinds}: {done.stderr}")
    plane.await_kinds(file)


def _etcd(plane: ControlPlane, port: int, peer_port: int) -> list[str]:
    client, peer = f"http://{ADDRESS}:{port}", f"http://{ADDRESS}:{peer_port}"
    return [
        str(plane.binaries / "etcd"),
        f"--data-dir={plane.folder / 'etcd'}",
        f"--listen-client-urls={client}",
        f"--advertise-client-urls={client}",
        f"--listen-peer-urls={peer}",
        f"--initial-advertise-peer-urls={peer}",
        f"--initial-cluster=default={peer}",
        "--unsafe-no-fsync",
        "--log-level=warn",
    ]


def _api_server(plane: ControlPlane, etcd_port: int) -> list[str]:
    serving, signing = plane.authority.server([ADDRESS]), plane.authority.signing_key()
    policy = plane.folder / "audit.json"
    policy.write_text(json.dumps(AUDIT))
    return [
        str(plane.binaries / "kube-apiserver"),
        f"--etcd-servers=http://{ADDRESS}:{etcd_port}",
        f"--bind-address={ADDRESS}",
        f"--advertise-address={ADDRESS}",
        f"--secure-port={plane.port}",
        f"--tls-cert-file={serving.certificate}",
        f"--tls-private-key-file={serving.key}",
        f"--client-ca-file={plane.authority.pair.certificate}",
        f"--service-account-key-file={signing}",
        f"--service-account-signing-key-file={signing}",
        f"--service-account-issuer={plane.server}",
        f"--service-cluster-ip-range={SERVICES}",
        "--endpoint-reconciler-type=none",
        "--authorization-mode=RBAC",
        "--enable-admission-plugins=OwnerReferencesPermissionEnforcement",  # OpenShift enables it too
        f"--audit-policy-file={policy}",
        f"--audit-log-path={plane.audit_log}",
        f"--audit-log-maxsize={AUDIT_MIB}",
    ]


def _controllers(plane: ControlPlane, requests_per_s: int | None) -> list[str]:
    user = "system:kube-controller-manager"
    rate = requests_per_s
    limits = [] if rate is None else [f"--kube-api-qps={rate}", f"--kube-api-burst={rate}"]
    return [
        str(plane.binaries / "kube-controller-manager"),
        f"--kubeconfig={plane.kubeconfig_of(user)}",
        f"--service-account-private-key-file={plane.folder / 'service-accounts.key'}",
        f"--root-ca-file={plane.authority.pair.certificate}",
        "--use-service-account-credentials",
        f"--controllers={','.join(CONTROLLERS)}",
        "--leader-elect=false",
        f"--bind-address={ADDRESS}",
        "--secure-port=0",
        *limits,
    ]


@contextmanager
def started(folder: Path, command: list[str]) -> Iterator["subprocess.Popen[bytes]"]:
    """Run a program until the block ends, with its log in `folder`.

    The program ends at the latest with this process.
    """
    if not shutil.which("setpriv"):
        raise DidNotStart(
            "setpriv is missing, without which processes could be left behind; install util-linux"
        )
    with (folder / f"{Path(command[0]).name}.log").open("wb") as log:
        process = subprocess.Popen(
            ["setpriv", "--pdeathsig", "KILL", "--", *command],
            env=os.environ | RARELY,
            stdin=subprocess.DEVNULL,
            stdout=log,
            stderr=subprocess.STDOUT,
        )
    try:
        yield process
    finally:
        process.terminate()
        try:
            process.wait(STOP_DEADLINE_S)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()


def _wait_ready(plane: ControlPlane, api_server: "subprocess.Popen[bytes]") -> None:
    ends = time.monotonic() + START_DEADLINE_S
    context = ssl.create_default_context(cafile=plane.authority.pair.certificate)
    admin = Pair(certificate=plane.folder / "admin.crt", key=plane.folder / "admin.key")
    context.load_cert_chain(admin.certificate, admin.key)
    while time.monotonic() < ends and api_server.poll() is None:
        with suppress(URLError, OSError):
            answer = urllib.request.urlopen(f"{plane.server}/readyz", context=context, timeout=5)
            answer.close()
            return
        threading.Event().wait(0.1)  # no event announces that a port has a listener
    log = (plane.folder / "kube-apiserver.log").read_text(errors="replace")[-3000:]
    raise DidNotStart(f"kube-apiserver: not ready in {START_DEADLINE_S} s; its log ends with\n{log}")


def _kubeconfig(path: Path, plane: ControlPlane, user: str, group: str) -> Path:
    pair = plane.authority.client(user, group, plane.clients)
    cluster = {"server": plane.server, "certificate-authority": str(plane.authority.pair.certificate)}
    credentials = {"client-certificate": str(pair.certificate), "client-key": str(pair.key)}
    content = {
        "apiVersion": "v1",
        "kind": "Config",
        "clusters": [{"name": "here", "cluster": cluster}],
        "users": [{"name": user, "user": credentials}],
        "contexts": [{"name": "here", "context": {"cluster": "here", "user": user}}],
        "current-context": "here",
    }
    path.write_text(json.dumps(content, indent=1))
    return path
