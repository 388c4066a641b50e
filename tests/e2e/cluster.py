"""A Kubernetes cluster as a user reaches it, through kubectl and the JSON of the API server.

The tests do not use Palaestra's own client, because an error in that client could then go unnoticed. One
`kubectl proxy` serves all requests, because kubectl supports every login method of a kubeconfig.
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
}  # the other kinds that tests use are in the core group
REQUEST_S = 30
COMMAND_S = 60
ROLLOUT_S = 120


class Refused(Exception):
    """The API server refused a request: HTTP status `code`, `reason` in one word, `message` in a sentence."""

    def __init__(self, code: int, status: Object) -> None:
        self.code = code
        self.reason = status.get("reason", "")
        self.message = status.get("message", "")
        super().__init__(f"{code} {self.reason}: {self.message}")


class Cluster:
    """A cluster that `kubectl` reaches with `options`; requests work inside a `with` block."""

    def __init__(self, kubectl: str, *options: str) -> None:
        self._kubectl = (kubectl, *options)
        self._proxy: subprocess.Popen[str] | None = None
        self._address = ""

    def __enter__(self) -> Self:
        """Start to serve the API on a port of the loopback interface."""
        # The proxy has a session of its own, because Ctrl-C must not end it before the cleanup.
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
        """Return the same cluster with the permissions of another user; enter it before use."""
        return type(self)(self._kubectl[0], f"--as={user}", f"--as-group={group}")

    def get(self, kind: str, namespace: str | None, name: str) -> Object | None:
        """Return an object, or None."""
        try:
            return self.request("GET", path(kind, namespace, name))
        except Refused as refusal:
            if refusal.code == 404:
                return None
            raise

    def select(self, kind: str, namespace: str | None, labels: str = "") -> list[Object]:
        """Return the objects of a kind that match a label selector."""
        items: list[Object] = self.request("GET", f"{path(kind, namespace)}?labelSelector={labels}")["items"]
        return items

    def create(self, kind: str, content: Object) -> Object:
        """Create an object in the namespace of its metadata, and return it as stored."""
        return self.request("POST", path(kind, content["metadata"].get("namespace")), content)

    def patch(self, kind: str, namespace: str | None, name: str, content: Object) -> Object:
        """Merge `content` into an object."""
        return self.request("PATCH", path(kind, namespace, name), content)

    def delete(self, kind: str, namespace: str | None, name: str, *, grace_s: int | None = None) -> None:
        """Delete an object and, in the background, those that it owns.

        An object that is already gone is not an error.
        """
        options: Object = {"propagationPolicy": "Background"}
        if grace_s is not None:
            options["gracePeriodSeconds"] = grace_s
        try:
            self.request("DELETE", path(kind, namespace, name), options)
        except Refused as refusal:
            if refusal.code != 404:
                raise

    def evict(self, namespace: str, pod: str) -> None:
        """Evict a pod as `kubectl drain` does."""
        metadata = {"name": pod, "namespace": namespace}
        content = {"apiVersion": "policy/v1", "kind": "Eviction", "metadata": metadata}
        self.request("POST", f"{path('pods', namespace, pod)}/eviction", content)

    def request(self, method: str, where: str, content: Object | None = None) -> Object:
        """Return the API server's response.

        Raises:
                Refused: the API server refused the request.
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
        """Run kubectl and return its output, even if kubectl fails."""
        ended = subprocess.run(
            [*self._kubectl, *arguments], capture_output=True, text=True, timeout=within_s, check=False
        )
        return ended.stdout + ended.stderr

    def rolled_out(self, namespace: str, deployment: str) -> None:
        """Wait until a Deployment is rolled out; a timeout raises no error here."""
        wait = f"--timeout={ROLLOUT_S}s"
        self.kubectl(
            "rollout", "status", f"deploy/{deployment}", "-n", namespace, wait, within_s=ROLLOUT_S + 10
        )

    def execute(self, namespace: str, pod: str, container: str, *command: str) -> str:
        """Run a command in a container, and return its standard output.

        Raises:
                CommandFailed: the command's exit code is not 0, or kubectl could not run the command.
        """
        ended = subprocess.run(
            [*self._kubectl, "exec", "-n", namespace, pod, "-c", container, "--", *command],
            capture_output=True, text=True, timeout=COMMAND_S, check=False,
        )  # fmt: skip
        if ended.returncode:
            raise CommandFailed(ended.returncode, ended.stderr)
        return ended.stdout


class CommandFailed(Exception):
    """A command in a container ended with `code`; `output` is its standard error."""

    def __init__(self, code: int, output: str) -> None:
        self.code, self.output = code, output
        super().__init__(f"exit code {code}: {output}")


def path(kind: str, namespace: str | None, name: str = "") -> str:
    """Return the API server's path for a kind, or for one object of the kind."""
    parts = [GROUPS.get(kind, "api/v1"), *(["namespaces", namespace] if namespace else []), kind]
    return "/".join([*parts, name] if name else parts)


def _status(body: bytes) -> Object:
    try:
        status = json.loads(body)
    except ValueError:
        return {"message": body.decode(errors="replace")}
    return status if isinstance(status, dict) else {}
