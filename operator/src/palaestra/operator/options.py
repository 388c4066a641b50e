"""The operator's options."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from palaestra.errors import PalaestraError
from palaestra.plan import Allowed, Images
from palaestra.plan.resources import NO_DEFAULTS, Defaults
from palaestra_protocol.http import Address
from palaestra_protocol.numbers import MOST_PORT

DEFAULT_NAMESPACE = "palaestra-system"
NAME = "palaestra-operator"  # the name of the Lease and of the objects of an installation
METRICS_ADDRESS = Address("0.0.0.0", 8080)  # noqa: S104 - the pod's address, for probes


@dataclass(frozen=True, slots=True, kw_only=True)
class OperatorOptions:
    """The options of the command line.

    Attributes:
        images: this release's images, for jobs that do not name images.
        operator_namespace: the namespace of the operator and its Lease; its pods may connect to trainers.
        monitoring_namespace: the namespace whose pods may scrape trainers and simulators.
        namespaces: the namespaces whose jobs this operator runs; empty: all namespaces.
        workers: the number of jobs that are reconciled at the same time.
        resync_s: seconds after which every job is reconciled again, even without a change.
        leader_elect: whether to wait for the Lease.
        metrics_address: host and port of the server for /healthz, /readyz and /metrics.
        node_selector: labels that the nodes of training pods must have.
        host_users: whether training pods use the user IDs of their nodes; if not, each pod has a user
            namespace.
        allowed: the values that jobs may have in settings that affect other users of the cluster.
        resources: the resources of containers for which a job does not set resources.
        has_webots_image: whether the installation has an image of Webots; if not, a job with driver webots
            must name an image.
        fixed_user: whether training pods set their user ID; if not, the cluster chooses the user ID.
        kubeconfig: the kubeconfig file; None: kubectl's default, or the pod's own service account.
        context: the context of the kubeconfig; None: its current context.
    """

    images: Images
    operator_namespace: str
    monitoring_namespace: str = "monitoring"
    namespaces: tuple[str, ...] = ()
    workers: int = 4
    resync_s: float = 600.0
    leader_elect: bool = True
    metrics_address: Address = METRICS_ADDRESS
    node_selector: Mapping[str, str] = field(default_factory=dict)
    host_users: bool = True
    allowed: Allowed = field(default_factory=Allowed)
    resources: Defaults = NO_DEFAULTS
    has_webots_image: bool = True
    fixed_user: bool = True
    kubeconfig: str | None = None
    context: str | None = None


def address(text: str) -> Address:
    """Return the address in a text such as `0.0.0.0:8080`; its host may be a name.

    Raises:
        PalaestraError: the text is not an address.
    """
    host, _, port = text.rpartition(":")
    if not host or not port.isdecimal() or int(port) > MOST_PORT:
        raise PalaestraError(f"--metrics-address: {text!r} is not an address; write it as 0.0.0.0:8080")
    return Address(host.removeprefix("[").removesuffix("]"), int(port))
