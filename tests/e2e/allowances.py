"""The permissions that the tests' installation gives to jobs; manifests/install.yaml gives none."""

from tests.e2e.cluster import Cluster
from tests.e2e.namespace import OPERATOR, SYSTEM

MISSING, LIMITED, URGENT = "palaestra-e2e-missing", "palaestra-e2e-limited", "palaestra-e2e-urgent"
OF_THE_PAGE = "urgent"  # the priority class of docs/howto/queues.md
OPTIONS = tuple(f"--allow-priority-class={name}" for name in (MISSING, LIMITED, URGENT, OF_THE_PAGE))


def allow(cluster: Cluster) -> None:
    """Allow jobs the priority classes of the tests, and wait until the operator has restarted with them."""
    deployment = cluster.get("deployments", SYSTEM, OPERATOR)
    assert deployment is not None, "Palaestra is not installed"
    [container] = deployment["spec"]["template"]["spec"]["containers"]
    if missing := [option for option in OPTIONS if option not in container["command"]]:
        wanted = {**container, "command": [*container["command"], *missing]}
        template = {"spec": {"containers": [wanted]}}
        cluster.patch("deployments", SYSTEM, OPERATOR, {"spec": {"template": template}})
    cluster.rolled_out(SYSTEM, OPERATOR)
