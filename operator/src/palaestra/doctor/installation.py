"""The operator: is it there, are its images fixed, does one lead, may it do its work, can it be measured?"""

import time
from collections.abc import Iterator
from importlib.metadata import version

from palaestra.client.errors import TookTooLong
from palaestra.client.following import changes
from palaestra.cluster import ApiError, Forbidden, NotFound
from palaestra.cluster.resources import DEPLOYMENTS, LEASES, PODS, WORKLOADS
from palaestra.doctor.finding import Finding, Site, right, unknown, warning, wrong
from palaestra.doctor.rights import OPERATOR, OPERATOR_WITH_KUEUE, Account, missing
from palaestra.objects import Object
from palaestra.operator.options import NAME
from palaestra.plan import Images
from palaestra.plan.network_policy import OPERATOR_LABEL

ROLES = "install the roles of this release, for this namespace too"
LOGS = "`kubectl logs -n {namespace} deploy/{name}` says why"
TRAINER_IMAGE = "--trainer-image="
STUB_IMAGE = "--stub-image="
DIGEST = "@sha256:"
NOT_ELECTED = "--no-leader-elect"
PORT_NAME = "metrics"
RENEWED_WITHIN_S = 20.0  # a Lease lasts 15


def runs(site: Site) -> Iterator[Finding]:
    """Check whether the operator is installed and ready."""
    deployment = _deployment(site)
    remedy = _remedy(site, deployment)
    if deployment is None:
        yield wrong("operator", f"there is none in {site.operator_namespace}", remedy)
        return
    image = _container(deployment)["image"]
    wanted = _wanted(deployment)
    if wanted == 0:
        yield wrong("operator", f"is scaled to 0 in {site.operator_namespace}, image {image}", remedy)
        return
    ready = deployment.get("status", {}).get("readyReplicas", 0)
    fact = f"{ready} of {wanted} are ready in {site.operator_namespace}, image {image}"
    yield right("operator", fact) if ready else wrong("operator", fact, remedy)


def images(site: Site) -> Iterator[Finding]:
    """Check that the operator's image, and those of jobs that name none, are named by digest."""
    deployment = _deployment(site)
    if deployment is not None:  # `runs` reports that there is none
        yield judged_images(_container(deployment))


def judged_images(container: Object) -> Finding:
    """Return what the images mean that the operator's container names: a tag can come to name another."""
    release = Images.of_release(version("palaestra"))
    named = (
        container["image"],
        _chosen(container, TRAINER_IMAGE, release.trainer),
        _chosen(container, STUB_IMAGE, release.stub),
    )
    tags = [image for image in named if DIGEST not in image]
    if not tags:
        return right("images", "are named by digest")
    return warning(
        "images",
        f"{', '.join(tags)}: a tag may name another image tomorrow, also for the next pod of a job",
        "set images.<name>.digest of the chart, see docs/install.md",
    )


def leads(site: Site) -> Iterator[Finding]:
    """Check whether one operator leads, by seeing it renew its Lease: no two clocks are compared."""
    deployment = _deployment(site)
    if deployment is not None and NOT_ELECTED in _container(deployment).get("command", ()):
        yield right("leader", "there is no election")
        return
    remedy = _remedy(site, deployment)
    if deployment is not None and _wanted(deployment) == 0:
        yield wrong("leader", f"the operator is scaled to 0 in {site.operator_namespace}", remedy)
        return
    deadline = time.monotonic() + RENEWED_WITHIN_S
    seen = False
    try:
        for lease in changes(site.api, LEASES, site.operator_namespace, NAME, deadline=deadline):
            holder = lease["spec"].get("holderIdentity")  # empty: its last leader gave it back
            if seen and holder:
                yield right("leader", f"is {holder}")
                return
            seen = True
    except TookTooLong:
        yield wrong("leader", f"the Lease {NAME} was not renewed for {RENEWED_WITHIN_S:.0f} s", remedy)
        return
    yield wrong("leader", f"there is no Lease {NAME} in {site.operator_namespace}", remedy)


def operator_rights(site: Site) -> Iterator[Finding]:
    """Report what the operator's account may not do in the namespace of the person who asks.

    The rights for Kueue are checked where the cluster serves the Workloads that the operator reads.
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
        yield warning(what, f"{fact}; a queued job does not say why Kueue does not admit it", ROLES)
    if not denied and not unread:
        yield right(what, f"suffice in {site.namespace}")


def metrics(site: Site) -> Iterator[Finding]:
    """Check whether an operator answers with its metrics, asked by way of the API server."""
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
            f"port {port} of pod {name} does not answer the API server: {error}",
            "a NetworkPolicy may let Prometheus in alone: look at its targets; else " + _logs(site),
        )
        return
    if "palaestra_" in text:
        yield right("metrics", f"are at port {port} of pod {name}")
    else:
        yield wrong("metrics", f"port {port} of pod {name} serves something else", _logs(site))


def trainer_image(site: Site) -> str:
    """Return the trainer's image where a job names none: the operator's choice, else the release's."""
    try:
        deployment = _deployment(site)
    except Forbidden:
        deployment = None
    release = Images.of_release(version("palaestra")).trainer
    return _chosen(_container(deployment), TRAINER_IMAGE, release) if deployment else release


def _chosen(container: Object, option: str, otherwise: str) -> str:
    """Return the value of an option of the operator's command line."""
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
    """Return what helps against an operator that does not do its work."""
    if deployment is None:
        return "install Palaestra, or name its namespace with --operator-namespace"
    if _wanted(deployment) == 0:
        return f"`kubectl scale -n {site.operator_namespace} deployment/{NAME} --replicas=1`"
    return _logs(site)


def _logs(site: Site) -> str:
    return LOGS.format(namespace=site.operator_namespace, name=NAME)
