"""A Kubernetes cluster as people reach it: the API server's own JSON, and kubectl.

Nothing of Palaestra's own client is used, so that a mistake in it cannot hide itself. One
`kubectl proxy` serves all requests: it knows every way to log in that a kubeconfig can name.
"""

import json
import subprocess
import urllib.error
import urllib.request
from typing import Any, Self

Object = dict[str, Any]

GROUPS = {
    "clusterroles": "apis/rbac.authorization.k8s.io/v1",
    "clusterqueues": "apis/kueue.x-k8s.io/v1beta2",
    "deployments": "apis/apps/v1",
    "events": "api/v1",
    "jobs": "apis/batch/v1",
    "leases": "apis/coordination.k8s.io/v1",
    "localqueues": "apis/kueue.x-k8s.io/v1beta2",
    "networkpolicies": "apis/networking.k8s.io/v1",
    "priorityclasses": "apis/scheduling.k8s.io/v1",
    "rolebindings": "apis/rbac.authorization.k8s.io/v1",
    "trainingjobs": "apis/palaestra.dev/v1alpha1",
    "workloads": "apis/kueue.x-k8s.io/v1beta2",
}  # every other kind that is used here belongs to the core
REQUEST_S = 30
COMMAND_S = 60
ROLLOUT_S = 120


class Refused(Exception):
    """The API server's no: `code` of HTTP, `reason` in one word, `message` in a sentence."""

    def __init__(self, code: int, status: Object) -> None:
        self.code = code
        self.reason = status.get("reason", "")
        self.message = status.get("message", "")
        super().__init__(f"{code} {self.reason}: {self.message}")


class Cluster:
    """A cluster that `kubectl` reaches as it is called here, with `options`, while this is entered."""

    def __init__(self, kubectl: str, *options: str) -> None:
        self._kubectl = (kubectl, *options)
        self._proxy: subprocess.Popen[str] | None = None
        self._address = ""

    def __enter__(self) -> Self:
        """Begin to serve the API on a port of loopback."""
        # Ended by us alone: Ctrl-C must leave it to what is still to be cleaned up.
        self._proxy = subprocess.Popen(
            ["setpriv", "--pdeathsig=TERM", *self._kubectl, "proxy", "--port=0"],
            stdout=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert self._proxy.stdout
        line = self._proxy.stdout.readline()
        self._address = f"http://{line.split()[-1]}" if line else ""
        assert self._address, "kubectl proxy did not start; does `kubectl get nodes` work?"
        return self

    def __exit__(self, *_: object) -> None:
        """End the proxy."""
        assert self._proxy
        assert self._proxy.stdout
        self._proxy.terminate()
        self._proxy.wait(REQUEST_S)
        self._proxy.stdout.close()

    def acting_as(self, user: str, group: str) -> Self:
        """Return the cluster as it answers to somebody else, to be entered."""
        return type(self)(self._kubectl[0], f"--as={user}", f"--as-group={group}")

    def get(self, kind: str, namespace: str | None, name: str) -> Object | None:
        """Return an object, None when there is none."""
        try:
            return self.request("GET", path(kind, namespace, name))
        except Refused as refusal:
            if refusal.code == 404:
                return None
            raise

    def select(self, kind: str, namespace: str | None, labels: str = "") -> list[Object]:
        """Return the objects of a kind, by a label selector."""
        items: list[Object] = self.request("GET", f"{path(kind, namespace)}?labelSelector={labels}")["items"]
        return items

    def create(self, kind: str, content: Object) -> Object:
        """Create an object, in the namespace that its metadata names; return it as it was accepted."""
        return self.request("POST", path(kind, content["metadata"].get("namespace")), content)

    def patch(self, kind: str, namespace: str | None, name: str, content: Object) -> Object:
        """Merge `content` into an object."""
        return self.request("PATCH", path(kind, namespace, name), content)

    def delete(self, kind: str, namespace: str | None, name: str, *, grace_s: int | None = None) -> None:
        """Delete an object and, in the background, what it owns; that it is gone already is no error."""
        options: Object = {"propagationPolicy": "Background"}
        if grace_s is not None:
            options["gracePeriodSeconds"] = grace_s
        try:
            self.request("DELETE", path(kind, namespace, name), options)
        except Refused as refusal:
            if refusal.code != 404:
                raise

    def evict(self, namespace: str, pod: str) -> None:
        """Ask for a pod as `kubectl drain` does."""
        metadata = {"name": pod, "namespace": namespace}
        content = {"apiVersion": "policy/v1", "kind": "Eviction", "metadata": metadata}
        self.request("POST", f"{path('pods', namespace, pod)}/eviction", content)

    def request(self, method: str, where: str, content: Object | None = None) -> Object:
        """Return the API server's answer.

        Raises:
            Refused: it said no.
        """
        kind = "application/merge-patch+json" if method == "PATCH" else "application/json"
        body = None if content is None else json.dumps(content).encode()
        asked = urllib.request.Request(
            f"{self._address}/{where}", data=body, method=method, headers={"Content-Type": kind}
        )
        try:
            with urllib.request.urlopen(asked, timeout=REQUEST_S) as answer:
                found: Object = json.load(answer)
                return found
        except urllib.error.HTTPError as error:
            with error:
                raise Refused(error.code, _status(error.read())) from None

    def kubectl(self, *arguments: str, within_s: float = COMMAND_S) -> str:
        """Run kubectl; return its output, whatever comes of it."""
        ended = subprocess.run(
            [*self._kubectl, *arguments], capture_output=True, text=True, timeout=within_s, check=False
        )
        return ended.stdout + ended.stderr

    def rolled_out(self, namespace: str, deployment: str) -> None:
        """Wait until a Deployment is as it is to be; what happens where it never is shows later."""
        wait = f"--timeout={ROLLOUT_S}s"
        self.kubectl(
            "rollout", "status", f"deploy/{deployment}", "-n", namespace, wait, within_s=ROLLOUT_S + 10
        )

    def execute(self, namespace: str, pod: str, container: str, *command: str) -> str:
        """Run a command in a container; return its standard output.

        Raises:
            CommandFailed: it ended with another code than 0, or could not be run.
        """
        ended = subprocess.run(
            [*self._kubectl, "exec", "-n", namespace, pod, "-c", container, "--", *command],
            capture_output=True, text=True, timeout=COMMAND_S, check=False,
        )  # fmt: skip
        if ended.returncode:
            raise CommandFailed(ended.returncode, ended.stderr)
        return ended.stdout


class CommandFailed(Exception):
    """A command in a container ended with `code`; `output` is what it wrote to standard error."""

    def __init__(self, code: int, output: str) -> None:
        self.code, self.output = code, output
        super().__init__(f"exit code {code}: {output}")


def path(kind: str, namespace: str | None, name: str = "") -> str:
    """Return where the API server keeps a kind, or an object of it."""
    parts = [GROUPS.get(kind, "api/v1"), *(["namespaces", namespace] if namespace else []), kind]
    return "/".join([*parts, name] if name else parts)


def _status(body: bytes) -> Object:
    try:
        status = json.loads(body)
    except ValueError:
        return {"message": body.decode(errors="replace")}
    return status if isinstance(status, dict) else {}
