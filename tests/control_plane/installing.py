"""Install Palaestra on a control plane without nodes.

All objects of install.yaml are created, except the Deployment and the CustomResourceDefinition.
"""

from palaestra.cluster import Api, Resource, connect
from tests.chart.installation import installed
from tests.control_plane.plane import ControlPlane
from tests.integration.operator.cluster import served
from tests.waiting import eventually

UNNAMESPACED = {"Namespace", "ClusterRole", "ClusterRoleBinding"}
PLURALS = {"NetworkPolicy": "networkpolicies"}
ELSEWHERE = {"Deployment", "CustomResourceDefinition"}  # tests define the kinds and run operators


def install(plane: ControlPlane) -> Api:
    """Create the objects, and return an administrator's client when the API server serves TrainingJobs."""
    api = connect(str(plane.kubeconfig))
    for obj in installed():
        kind = obj["kind"]
        if kind not in ELSEWHERE:
            resource = Resource(
                api_version=obj["apiVersion"],
                kind=kind,
                plural=PLURALS.get(kind, f"{kind.lower()}s"),
                namespaced=kind not in UNNAMESPACED,
            )
            api.create(resource, obj)
    eventually(lambda: served(api))
    return api
