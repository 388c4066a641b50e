"""How the operator is started."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from palaestra.errors import PalaestraError
from palaestra.plan import Images

DEFAULT_NAMESPACE = "palaestra-system"
NAME = "palaestra-operator"  # of the Lease, and of whatever an installation makes
MOST_PORT = 65_535


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """What a person may choose.

    Attributes:
        images: the release's own, for jobs that name none.
        operator_namespace: where the operator and its Lease are; its pods may ask trainers.
        monitoring_namespace: whose pods may scrape trainers and simulators.
        namespaces: those whose jobs are looked after; none: all of them.
        workers: jobs that are looked at at once.
        resync_s: seconds after which every job is looked at again though nothing changed.
        leader_elect: whether to wait for the Lease.
        metrics_address: host and port of /healthz, /readyz and /metrics.
        node_selector: labels that the nodes of training pods must have.
        allowed_pod_labels: keys, or domains that end in `/`, of labels that jobs may give their pods.
        allowed_pod_annotations: the same of annotations.
        kubeconfig: the file to connect with; None: as kubectl finds it, or the pod's own account.
        context: of the kubeconfig; None: its current one.
    """

    images: Images
    operator_namespace: str
    monitoring_namespace: str = "monitoring"
    namespaces: tuple[str, ...] = ()
    workers: int = 4
    resync_s: float = 600.0
    leader_elect: bool = True
    metrics_address: tuple[str, int] = ("0.0.0.0", 8080)  # noqa: S104 - the pod's address, for probes
    node_selector: Mapping[str, str] = field(default_factory=dict)
    allowed_pod_labels: tuple[str, ...] = ()
    allowed_pod_annotations: tuple[str, ...] = ()
    kubeconfig: str | None = None
    context: str | None = None


def address(text: str) -> tuple[str, int]:
    """Return host and port of `0.0.0.0:8080`.

    Raises:
        PalaestraError: it is none.
    """
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or int(port) > MOST_PORT:
        raise PalaestraError(f"--metrics-address: {text!r} is no address; write it as 0.0.0.0:8080")
    return host.removeprefix("[").removesuffix("]"), int(port)
