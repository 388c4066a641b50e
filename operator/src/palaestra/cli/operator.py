"""`palaestra operator`: reconcile the TrainingJobs of a cluster."""

import argparse
import json
import re
from importlib.metadata import version

from palaestra.api.container import Resources
from palaestra.cli.subcommands import Commands, command
from palaestra.cluster import own_namespace
from palaestra.operator.options import DEFAULT_NAMESPACE, OperatorOptions, address
from palaestra.operator.run import run
from palaestra.plan import Allowed, Images
from palaestra.plan.resources import Defaults
from palaestra_protocol.numbers import seconds, whole

OPERATOR = """\
Watches the TrainingJobs of a cluster, creates the objects that they need, and writes their status. Reads the
kubeconfig as kubectl does; in a pod it uses the pod's service account. Logs one JSON object per line to
standard error. Exits within 2 s of SIGTERM. Of several operators, one leads and the others wait.
"""

NAME = r"[A-Za-z0-9]([-A-Za-z0-9_.]{0,61}[A-Za-z0-9])?"
DOMAIN = r"[a-z0-9]([-a-z0-9.]{0,251}[a-z0-9])?/"
OBJECT = re.compile(r"[a-z0-9]([-a-z0-9.]{0,251}[a-z0-9])?")
ALLOWED = re.compile(rf"({DOMAIN})?{NAME}|{DOMAIN}")
NODE_LABEL = re.compile(rf"({DOMAIN})?{NAME}=({NAME})?")

# Settings of jobs that an installation may allow. Each row has the end of the option's name, the field of
# `Allowed`, the type of the option's value, and the meaning.
ALLOWANCES = (
    ("pod-label", "pod_labels", "KEY", "label that jobs may set on their pods"),
    ("pod-annotation", "pod_annotations", "KEY", "annotation that jobs may set on their pods"),
    ("priority-class", "priority_classes", "NAME", "PriorityClass that jobs may have"),
    ("runtime-class", "runtime_classes", "NAME", "RuntimeClass that jobs may have"),
    ("toleration", "tolerations", "KEY", "taint that jobs may tolerate"),
    (
        "affinity-namespace",
        "affinity_namespaces",
        "NAME",
        "namespace to whose pods jobs may have an affinity",
    ),
    (
        "anti-affinity-label",
        "anti_affinity_labels",
        "KEY",
        "label by which a required anti-affinity may select pods of other jobs",
    ),
)


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "operator", _operator, OPERATOR)
    _add_looking(parser)
    parser.add_argument(
        "--leader-elect",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="wait for the Lease before the first write; default: yes",
    )
    parser.add_argument(
        "--metrics-address",
        metavar="HOST:PORT",
        default="0.0.0.0:8080",
        help="address of /healthz, /readyz and /metrics; default: 0.0.0.0:8080, every IPv4 and IPv6 address",
    )
    _add_cluster(parser)
    _add_pods(parser)
    _add_users(parser)
    _add_images(parser)


def _add_looking(parser: argparse.ArgumentParser) -> None:
    """Add the options for the namespaces of the jobs, the number of workers, and the resync interval."""
    parser.add_argument(
        "--namespace",
        metavar="NS",
        dest="namespaces",
        action="append",
        default=[],
        help="reconcile the jobs of this namespace only; may be repeated; default: all",
    )
    parser.add_argument(
        "--workers",
        metavar="N",
        type=whole(1),
        default=4,
        help="jobs reconciled at the same time; default: 4",
    )
    parser.add_argument(
        "--resync",
        metavar="S",
        type=seconds,
        default=600.0,
        help="seconds after which every job is reconciled again; default: 600",
    )


def _add_pods(parser: argparse.ArgumentParser) -> None:
    for option, field, metavar, meaning in ALLOWANCES:
        keys = metavar == "KEY"
        parser.add_argument(
            f"--allow-{option}",
            metavar=metavar,
            type=_key if keys else _name,
            dest=field,
            action="append",
            default=[],
            help=f"{meaning}{', or its domain with a / at the end' if keys else ''}; may be repeated; "
            "default: none",
        )
    parser.add_argument(
        "--node-selector",
        metavar="KEY=VALUE",
        type=_node_label,
        dest="node_selector",
        action="append",
        default=[],
        help="label that the nodes of training pods must have, unless a job sets another value; "
        "may be repeated; default: none",
    )
    parser.add_argument(
        "--fixed-user",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="run training pods as user 65532; --no-fixed-user: as the user that the cluster chooses; "
        "default: yes",
    )
    for container in ("ros-master", "simulator", "trainer"):
        parser.add_argument(
            f"--{container}-resources",
            metavar="JSON",
            type=_resources,
            default=Resources(),
            help=f"requests and limits of each {container} of a job that sets no resources, such as "
            '{"limits": {"cpu": "500m"}}; default: the values of the release',
        )


def _resources(text: str) -> Resources:
    try:
        given = json.loads(text)
        return Resources.model_validate(
            {field: {name: str(value) for name, value in given[field].items()} for field in given}
        )
    except (AttributeError, TypeError, ValueError) as error:
        raise argparse.ArgumentTypeError(
            f'{text!r} does not describe resources; use JSON such as {{"limits": {{"cpu": "500m"}}}}'
        ) from error


def _add_users(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--host-users",
        action=argparse.BooleanOptionalAction,
        default=True,
        help="run training pods with the user IDs of their nodes; --no-host-users: with a user namespace for "
        "each pod; default: yes",
    )


def _name(text: str) -> str:
    if not OBJECT.fullmatch(text):
        raise argparse.ArgumentTypeError(f"{text!r} is not the name of an object; use a-z, 0-9, '-' and '.'")
    return text


def _key(text: str) -> str:
    if not ALLOWED.fullmatch(text):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a key; use a key such as example.com/team, or a domain such as example.com/"
        )
    return text


def _node_label(text: str) -> tuple[str, str]:
    if not NODE_LABEL.fullmatch(text):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a label; use a label such as kubernetes.io/arch=amd64"
        )
    key, _, value = text.partition("=")
    return key, value


def _add_cluster(parser: argparse.ArgumentParser) -> None:
    parser.add_argument(
        "--kubeconfig",
        metavar="FILE",
        help="kubeconfig; default: $KUBECONFIG, then ~/.kube/config, then the pod's service account",
    )
    parser.add_argument(
        "--context", metavar="NAME", help="context of the kubeconfig; default: the current one"
    )
    parser.add_argument(
        "--operator-namespace",
        metavar="NS",
        default=own_namespace(DEFAULT_NAMESPACE),
        help="namespace of this operator; default: the pod's own, else palaestra-system",
    )
    parser.add_argument(
        "--monitoring-namespace",
        metavar="NS",
        default="monitoring",
        help="namespace of the pods that may scrape training pods; default: monitoring",
    )


def _add_images(parser: argparse.ArgumentParser) -> None:
    release = Images.of_release(version("palaestra"))
    for name in ("trainer", "stub", "mujoco"):
        image = getattr(release, name)
        meaning = f"image for jobs that do not name an image; default: {image}"
        parser.add_argument(f"--{name}-image", metavar="IMAGE", default=image, help=meaning)
    parser.add_argument(
        "--webots-image",
        metavar="IMAGE",
        help="image for simulators with driver webots and no image; without this option, a job with such a "
        "simulator waits, because Palaestra publishes no image of Webots",
    )


def _operator(options: argparse.Namespace) -> int:
    images = Images(
        trainer=options.trainer_image,
        stub=options.stub_image,
        mujoco=options.mujoco_image,
        webots=options.webots_image or Images.of_release(version("palaestra")).webots,
    )
    return run(
        OperatorOptions(
            images=images,
            has_webots_image=options.webots_image is not None,
            operator_namespace=options.operator_namespace,
            monitoring_namespace=options.monitoring_namespace,
            namespaces=tuple(dict.fromkeys(options.namespaces)),
            workers=options.workers,
            resync_s=options.resync,
            leader_elect=options.leader_elect,
            metrics_address=address(options.metrics_address),
            node_selector=dict(options.node_selector),
            host_users=options.host_users,
            allowed=Allowed(**{field: tuple(getattr(options, field)) for _, field, *_ in ALLOWANCES}),
            resources=Defaults(
                ros_master=options.ros_master_resources,
                simulator=options.simulator_resources,
                trainer=options.trainer_resources,
            ),
            fixed_user=options.fixed_user,
            kubeconfig=options.kubeconfig,
            context=options.context,
        )
    )
