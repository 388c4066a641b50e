"""The API server's audit log of the requests of service accounts.

tests/cluster/audit-policy.yaml determines which requests are logged. The kubelet serves the log of its node
to administrators.
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

    A cluster that these tests did not create may write no audit log; the test is then skipped.
    """
    nodes = [node["metadata"]["name"] for node in cluster.select("nodes", None)]
    logs = [cluster.kubectl("get", "--raw", LOG.format(node=node)) for node in nodes]
    log = "".join(log for log in logs if log.startswith("{"))
    if not log and os.environ.get("PALAESTRA_CLUSTER") == "existing":
        pytest.skip("this cluster's API server writes no audit log to /var/log/kubernetes/audit.log")
    assert log, f"no audit log; is the cluster of an earlier checkout? `make cluster-down`: {logs}"
    return list(uses(log, since=BEGUN))
