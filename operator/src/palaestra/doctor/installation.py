"""Checks of the operator: its replicas, images, leader, permissions and metrics."""

import time
from collections.abc import Iterator
from importlib.metadata import version

from palaestra.client.errors import TookTooLong
from palaestra.client.watch import changes
from palaestra.cluster import ApiError, Forbidden, NotFound
from palaestra.cluster.resources import DEPLOYMENTS, LEASES, PODS, WORKLOADS
from palaestra.doctor.check_result import CheckResult, Site, right, unknown, warning, wrong
from palaestra.doctor.rbac import OPERATOR, OPERATOR_WITH_KUEUE, Account, missing
from palaestra.objects import Object
from palaestra.operator.options import NAME
from palaestra.plan import Images
from palaestra.plan.network_policy import OPERATOR_LABEL

ROLES = "install the roles of this release, for this namespace too"
LOGS = "read `kubectl logs -n {namespace} deploy/{name}`"
TRAINER_IMAGE = "--trainer-image="
STUB_IMAGE = "--stub-image="
MUJOCO_IMAGE = "--mujoco-image="
WEBOTS_IMAGE = "--webots-image="
DIGEST = "@sha256:"
NOT_ELECTED = "--no-leader-elect"
PORT_NAME = "metrics"
RENEWED_WITHIN_S = 20.0  # a Lease is valid for 15 s


def runs(site: Site) -> Iterator[CheckResult]:
    """Check whether the operator is installed and ready."""
    deployment = _deployment(site)
    remedy = _remedy(site, deployment)
    if deployment is None:
        yield wrong("operator", f"is not installed in {site.operator_namespace}", remedy)
        return
    image = _container(deployment)["image"]
    wanted = _wanted(deployment)
    if wanted == 0:
        yield wrong("operator", f"is scaled to 0 in {site.operator_namespace}, image {image}", remedy)
        return
    ready = deployment.get("status", {}).get("readyReplicas", 0)
    fact = f"{ready} of {wanted} are ready in {site.operator_namespace}, image {image}"
    yield right("operator", fact) if ready else wrong("operator", fact, remedy)


def images(site: Site) -> Iterator[CheckResult]:
    """Check whether the operator's image and the default images of jobs are pinned by digest."""
    deployment = _deployment(site)
    if deployment is not None:  # the check `runs` reports a missing Deployment
        yield judged_images(_container(deployment))


def judged_images(container: Object) -> CheckResult:
    """Return the result for the images in the operator's container: a warning if an image has no digest."""
    release = Images.of_release(version("palaestra"))
    named = (
        container["image"],
        _chosen(container, TRAINER_IMAGE, release.trainer),
        _chosen(container, STUB_IMAGE, release.stub),
        _chosen(container, MUJOCO_IMAGE, release.mujoco),
        *filter(None, [_chosen(container, WEBOTS_IMAGE, "")]),  # absent: no default image of Webots
    )
    tags = [image for image in named if DIGEST not in image]
    if not tags:
        return right("images", "are pinned by digest")
    return warning(
        "images",
        f"{', '.join(tags)}: a tag may be moved to another image, which a job's next pod would use",
        "set the chart's values images.<name>.digest, see docs/howto/install.md",
    )


def leads(site: Site) -> Iterator[CheckResult]:
    """Check whether an operator leads: wait until it renews its Lease, because clocks cannot be compared."""
    deployment = _deployment(site)
    if deployment is not None and NOT_ELECTED in _container(deployment).get("command", ()):
        yield right("leader", "leader election is disabled")
        return
    remedy = _remedy(site, deployment)
    if deployment is not None and _wanted(deployment) == 0:
        yield wrong("leader", f"the operator is scaled to 0 in {site.operator_namespace}", remedy)
        return
    deadline = time.monotonic() + RENEWED_WITHIN_S
    seen = False
    try:
        for lease in changes(site.api, LEASES, site.operator_namespace, NAME, deadline=deadline):
            holder = lease["spec"].get("holderIdentity")  # empty if the last leader has released the Lease
            if seen and holder:
                yield right("leader", f"is {holder}")
                return
            seen = True
    except TookTooLong:
        yield wrong("leader", f"the Lease {NAME} was not renewed for {RENEWED_WITHIN_S:.0f} s", remedy)
        return
    yield wrong("leader", f"there is no Lease {NAME} in {site.operator_namespace}", remedy)


def operator_rights(site: Site) -> Iterator[CheckResult]:
    """Report the permissions that the operator's account lacks in the namespace of the jobs.

    The permissions for Kueue are checked if the cluster serves Kueue's Workloads.
    """
    what, deployment = "operator's rights", _deployment(site)
    name = deployment["spec"]["template"]["spec"]["serviceAccountName"] if deployment else NAME
    account = Account(namespace=site.operator_namespace, name=name)
    denied = missing(site, OPERATOR, account=account)
    has_kueue = site.api.serves(WORKLOADS.api_version)
    unread = missing(site, OPERATOR_WITH_KUEUE, account=account) if has_kueue else []
    if denied:
        fact = f"service account {name} may not {', '.join(denied)} in {site.namespace}"
        yield wrong(what, fact, ROLES)
    if unread:
        fact = f"service account {name} may not {', '.join(unread)} in {site.namespace}"
        yield warning(
            what, f"{fact}, so the status of a queued job does not explain why Kueue does not admit it", ROLES
        )
    if not denied and not unread:
        yield right(what, f"suffice in {site.namespace}")


def metrics(site: Site) -> Iterator[CheckResult]:
    """Check whether an operator serves its metrics; the request goes through the API server."""
    pods = site.api.list(PODS, site.operator_namespace, labels=f"{OPERATOR_LABEL}=true")
    running = [pod for pod in pods if pod["status"].get("phase") == "Running"]
    if not running:
        remedy = _remedy(site, _deployment(site))
        yield wrong("metrics", f"no operator runs in {site.operator_namespace}", remedy)
        return
    name, port = running[0]["metadata"]["name"], _port(running[0])
    try:
        text = site.api.proxied(site.operator_namespace, name, port, "metrics")
    except Forbidden:
        raise
    except ApiError as error:
        yield unknown(
            "metrics",
            f"port {port} of pod {name} does not respond to the API server: {error}",
            "if a NetworkPolicy admits only Prometheus, check Prometheus' targets; otherwise " + _logs(site),
        )
        return
    if "palaestra_" in text:
        yield right("metrics", f"are served on port {port} of pod {name}")
    else:
        yield wrong("metrics", f"port {port} of pod {name} does not serve Palaestra's metrics", _logs(site))


def trainer_image(site: Site) -> str:
    """Return the default image of trainers: the operator's option, or else the image of this release."""
    try:
        deployment = _deployment(site)
    except Forbidden:
        deployment = None
    release = Images.of_release(version("palaestra")).trainer
    return _chosen(_container(deployment), TRAINER_IMAGE, release) if deployment else release


def _chosen(container: Object, option: str, otherwise: str) -> str:
    """Return the value of an option in the operator's command line; `otherwise` if the option is absent."""
    given = container.get("command", ())
    return next(
        (argument.removeprefix(option) for argument in given if argument.startswith(option)), otherwise
    )


def _deployment(site: Site) -> Object | None:
    try:
        return site.api.get(DEPLOYMENTS, site.operator_namespace, NAME)
    except NotFound:
        return None


def _container(deployment: Object) -> Object:
    container: Object = deployment["spec"]["template"]["spec"]["containers"][0]
    return container


def _port(pod: Object) -> int:
    ports = [port for container in pod["spec"]["containers"] for port in container.get("ports", ())]
    return next(int(port["containerPort"]) for port in ports if port.get("name") == PORT_NAME)


def _wanted(deployment: Object) -> int:
    return int(deployment["spec"].get("replicas", 1))


def _remedy(site: Site, deployment: Object | None) -> str:
    """Return the remedy for an operator that is missing, scaled to 0 or not working."""
    if deployment is None:
        return "install Palaestra, or name its namespace with --operator-namespace"
    if _wanted(deployment) == 0:
        return f"`kubectl scale -n {site.operator_namespace} deployment/{NAME} --replicas=1`"
    return _logs(site)


def _logs(site: Site) -> str:
    return LOGS.format(namespace=site.operator_namespace, name=NAME)
