"""A kubelet for a control plane without nodes: it runs the pods of simulators as processes of this machine.

Each pod has an address of its own in 127.0.0.0/8. The processes are not isolated, so their programs must be
in the environment of the tests.
"""

import base64
import itertools
import os
import subprocess
import sys
import threading
from contextlib import suppress
from datetime import UTC, datetime
from pathlib import Path

from palaestra.cluster import ApiError, NotFound
from palaestra.cluster.resources import CONFIG_MAPS, PODS

PROGRAMS = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
SELECTED = "palaestra.dev/simulator"
_LOOK_S = 0.1
_ENDS_S = 20
_numbers = itertools.count(os.getpid() % 250 * 200 + 2)


class PodRunner:
    """Runs the pods of simulators in one namespace, until `close`.

    Args:
        api: a client of the control plane, as administrator.
        namespace: the namespace.
        folder: a folder for the files of ConfigMaps.

    Attributes:
        held_up: if set, the kubelet reports this reason and message instead of starting a pod.
    """

    def __init__(self, api, namespace, folder):
        self.held_up = None
        self._api = api
        self._namespace = namespace
        self._folder = folder
        self._running = {}
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._loop, daemon=True)
        self._thread.start()

    def processes(self):
        """Return the processes that run."""
        return [each for started in self._running.values() for each in started if each.poll() is None]

    def close(self):
        """End all processes."""
        self._closed.set()
        self._thread.join()
        for name in list(self._running):
            self._end(name)

    def _loop(self):
        while not self._closed.wait(_LOOK_S):
            with suppress(ApiError):  # an object changed meanwhile; the next poll reads its new version
                self._look()

    def _look(self):
        pods = {
            pod["metadata"]["name"]: pod for pod in self._api.list(PODS, self._namespace, labels=SELECTED)
        }
        for name in set(self._running) - set(pods):
            self._end(name)
        for name, pod in pods.items():
            if self.held_up:
                reason, message = self.held_up
                self._report(pod, "Pending", {"waiting": {"reason": reason, "message": message}})
            elif name not in self._running:
                self._start(name, pod)
            elif (code := self._running[name][-1].poll()) is not None:
                self._ended(name, pod, code)

    def _start(self, name, pod):
        number = next(_numbers)
        address = f"127.9.{number // 250 % 250}.{number % 250 + 1}"
        spec = pod["spec"]
        containers = [*spec.get("initContainers", ()), *spec["containers"]]
        self._running[name] = [self._process(name, each, address) for each in containers]
        started = {"running": {"startedAt": _now()}}
        self._report(pod, "Running", started, podIP=address, podIPs=[{"ip": address}])

    def _process(self, name, container, address):
        own = {each["name"]: each.get("value", address) for each in container["env"]}
        words = [word.replace("0.0.0.0", address) for word in container["command"]]
        words = [word.replace("/worlds/", f"{self._world(name)}/") for word in words]
        own["ROS_MASTER_URI"] = own["ROS_MASTER_URI"].replace("127.0.0.1", address)
        with (self._folder / f"{name}.log").open("ab") as log:
            return subprocess.Popen(
                words,
                env={**own, "PATH": PROGRAMS},
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=log,
            )

    def _world(self, pod):
        """Return the folder with the files of the pod's ConfigMap."""
        folder = self._folder / pod
        folder.mkdir(exist_ok=True)
        with suppress(NotFound):
            found = self._api.get(CONFIG_MAPS, self._namespace, pod.rpartition("-")[0])
            for name, content in found["binaryData"].items():
                (folder / name).write_bytes(base64.b64decode(content))
        return folder

    def _ended(self, name, pod, code):
        said = (self._folder / f"{name}.log").read_text()
        ended = {"exitCode": code, "message": said, "startedAt": _now(), "finishedAt": _now()}
        self._report(pod, "Failed" if code else "Succeeded", {"terminated": ended})

    def _report(self, pod, phase, state, **more):
        name = pod["metadata"]["name"]
        main = {"name": "simulator", "image": "i", "imageID": "", "restartCount": 0, "ready": True}
        status = {"phase": phase, "containerStatuses": [{**main, "state": state}], **more}
        self._api.merge(PODS, self._namespace, name, {"status": status}, subresource="status")

    def _end(self, name):
        processes = self._running.pop(name)
        for process in processes:
            process.terminate()
        for process in processes:
            process.wait(_ENDS_S)


def _now():
    return f"{datetime.now(UTC):%Y-%m-%dT%H:%M:%SZ}"
