"""Pods from which a test sends requests to other pods; the test chooses their namespace and labels."""

from importlib.metadata import version

from tests.e2e.cluster import CommandFailed, Object
from tests.e2e.namespace import ASK, Namespace, runs, trains

IMAGE = f"palaestra-stub:{version('palaestra-sim')}"
CONNECT_S = 3
RESTRICTED_CONTAINER = {
    "allowPrivilegeEscalation": False,
    "capabilities": {"drop": ["ALL"]},
    "readOnlyRootFilesystem": True,
}
RESTRICTED_POD = {"runAsNonRoot": True, "runAsUser": 65532, "seccompProfile": {"type": "RuntimeDefault"}}
CONNECT = """
import socket, sys
try:
    socket.create_connection((sys.argv[1], int(sys.argv[2])), timeout=float(sys.argv[3])).close()
except OSError:
    print("closed")
else:
    print("open")
"""
LISTEN = """
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
ThreadingHTTPServer(("", 9090), SimpleHTTPRequestHandler).serve_forever()
"""


def plain_pod(name: str, labels: dict[str, str] | None = None, **container: object) -> Object:
    """Return a pod with one small container that sleeps. The pod satisfies the *restricted* standard."""
    return {
        "apiVersion": "v1",
        "kind": "Pod",
        "metadata": {"name": name, "labels": labels or {}},
        "spec": {
            "automountServiceAccountToken": False,
            "terminationGracePeriodSeconds": 1,
            "securityContext": RESTRICTED_POD,
            "containers": [
                {
                    "name": "main",
                    "image": IMAGE,
                    "command": ["sleep", "infinity"],
                    "resources": {"requests": {"cpu": "5m", "memory": "32Mi"}},
                    "securityContext": RESTRICTED_CONTAINER,
                    **container,
                }
            ],
        },
    }


class Asker:
    """A pod with these `labels` from which a test sends requests; it runs until its namespace is deleted."""

    def __init__(
        self, namespace: Namespace, name: str, labels: dict[str, str] | None = None, **container: object
    ) -> None:
        self.namespace, self.name, self.labels = namespace, name, labels or {}
        namespace.create("pods", plain_pod(name, labels, **container))
        namespace.wait(lambda: trains(namespace.get("pods", name) or {"status": {}}))

    def get(self, pod: Object, port: int, path: str) -> str:
        """Return another pod's response over HTTP."""
        address = f"http://{pod['status']['podIP']}:{port}{path}"
        return self.namespace.execute(self.name, "python3", "-c", ASK, address, container="main")

    def reaches(self, pod: Object, port: int) -> bool:
        """Return whether a connection to another pod's port succeeds.

        A busy cluster can refuse a command in a container. Such a failure says nothing about the port, so
        the command is repeated.
        """
        assert runs(pod)
        where = (pod["status"]["podIP"], str(port), str(CONNECT_S))
        return self.namespace.wait(lambda: self._connect(*where)) == "open"

    def _connect(self, *where: str) -> str:
        """Return "open" or "closed", or an empty string if the command did not run."""
        command = ("python3", "-c", CONNECT, *where)
        try:
            return self.namespace.execute(self.name, *command, container="main").strip()
        except CommandFailed:
            return ""
