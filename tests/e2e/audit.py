"""The API server's record of the service accounts' requests.

tests/cluster/audit-policy.yaml determines the record; the kubelet shows its node's logs to administrators.
"""

import os
from datetime import UTC, datetime

import pytest

from tests.chart.rights import Use, uses
from tests.e2e.cluster import Cluster

LOG = "/api/v1/nodes/{node}/proxy/logs/kubernetes/audit.log"
BEGUN = datetime.now(UTC).isoformat()  # modules are imported before the first test


def recorded(cluster: Cluster) -> list[Use]:
    """Return all requests of service accounts since the tests began.

    A cluster that somebody else made may have no record; the test is then skipped.
    """
    nodes = [node["metadata"]["name"] for node in cluster.select("nodes", None)]
    logs = [cluster.kubectl("get", "--raw", LOG.format(node=node)) for node in nodes]
    log = "".join(log for log in logs if log.startswith("{"))
    if not log and os.environ.get("PALAESTRA_CLUSTER") == "existing":
        pytest.skip("this cluster's API server writes no audit log to /var/log/kubernetes/audit.log")
    assert log, f"no audit log; is the cluster of an earlier checkout? `make cluster-down`: {logs}"
    return list(uses(log, since=BEGUN))
