"""Read a planned pod by the rules of a kubelet: containers, commands, environment, probes and volumes.

Only settings that apply to a process on this machine are read. Images, resources, security contexts and
scheduling are ignored. Two settings are refused, because this machine cannot provide them: a value from an
object of the cluster, and a second main container.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from palaestra.local.errors import RunRefused

GRACE_S = 30.0  # Kubernetes' default terminationGracePeriodSeconds


@dataclass(frozen=True, slots=True, kw_only=True)
class Probe:
    """A startup or liveness probe: either a command or a URL."""

    command: tuple[str, ...] = ()
    url: str = ""
    initial_delay_s: float = 0.0
    period_s: float = 10.0
    timeout_s: float = 1.0
    failure_threshold: int = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Container:
    """One container of a pod.

    `sidecar` is whether the container is a native sidecar: an init container that is restarted while the pod
    runs.
    """

    name: str
    command: tuple[str, ...]
    env: Mapping[str, str]
    sidecar: bool = False
    startup: Probe | None = None
    liveness: Probe | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Pod:
    """One pod: `init` has the init containers in the order of their start; the end of `main` ends the pod."""

    uid: str
    init: tuple[Container, ...]
    main: Container
    grace_s: float
    mounts: Mapping[str, str]  # volume name -> directory

    @property
    def containers(self) -> tuple[Container, ...]:
        """Return all containers in the order of their start."""
        return (*self.init, self.main)


def read_pod(template: Mapping[str, Any], uid: str) -> Pod:
    """Return the pod of a Job's template, for the attempt with `uid`.

    Raises:
        RunRefused: the pod needs a feature or an object that only a cluster has.
    """
    spec = template["spec"]
    main, *others = spec["containers"]
    if others:
        raise RunRefused(
            f"container {others[0]['name']}: a pod that runs on this machine can have only one main container"
        )
    return Pod(
        uid=uid,
        init=tuple(_container(container, uid) for container in spec.get("initContainers", ())),
        main=_container(main, uid),
        grace_s=float(spec.get("terminationGracePeriodSeconds", GRACE_S)),
        mounts={
            mount["name"]: mount["mountPath"]
            for each in (*spec.get("initContainers", ()), main)
            for mount in each.get("volumeMounts", ())
        },
    )


def _container(spec: Mapping[str, Any], uid: str) -> Container:
    name = spec["name"]
    return Container(
        name=name,
        command=tuple(map(_read, (*spec["command"], *spec.get("args", ())))),
        env={entry["name"]: _value(name, entry, uid) for entry in spec.get("env", ())},
        sidecar=spec.get("restartPolicy") == "Always",
        startup=_probe(spec.get("startupProbe")),
        liveness=_probe(spec.get("livenessProbe")),
    )


def _value(container: str, entry: Mapping[str, Any], uid: str) -> str:
    source = entry.get("valueFrom")
    if source is None:
        return _read(entry.get("value", ""))
    if source.get("fieldRef", {}).get("fieldPath") == "metadata.uid":
        return uid
    raise RunRefused(
        f"env {entry['name']} of container {container}: its value is in an object that only a cluster has; "
        "give it as `value` to run the job here"
    )


def _read(text: str) -> str:
    """Return a text as a kubelet passes it to a container: $$ becomes $. Plans use no `$(VARIABLE)`."""
    return text.replace("$$", "$")


def _probe(spec: Mapping[str, Any] | None) -> Probe | None:
    if spec is None:
        return None
    command: Sequence[str] = spec.get("exec", {}).get("command", ())
    get = spec.get("httpGet")
    return Probe(
        command=tuple(command),
        url=f"http://{get.get('host', '127.0.0.1')}:{get['port']}{get['path']}" if get else "",
        initial_delay_s=float(spec.get("initialDelaySeconds", 0)),
        period_s=float(spec.get("periodSeconds", 10)),
        timeout_s=float(spec.get("timeoutSeconds", 1)),
        failure_threshold=int(spec.get("failureThreshold", 3)),
    )
