"""The network access to the pods of a job."""

import pytest

from palaestra.plan import ClusterLayout, Images, LocalLayout, PlanError, plan

IMAGES = Images.of_release("1")


def policy(planned):
    """Return the spec of the NetworkPolicy."""
    return planned.network_policy["spec"]


def test_a_laptop_needs_no_policy(valid_job):
    """A local run listens on loopback only, and has no pod network to protect."""
    planned = plan(valid_job(), LocalLayout(images=IMAGES, job_directory="/runs/job"))

    assert planned.network_policy is None


def test_all_pods_of_the_job_and_no_others_are_meant(in_cluster):
    """One policy selects the pods of all replicas by the label with the job's name."""
    planned = in_cluster(replicas=2)
    selected = policy(planned)["podSelector"]["matchLabels"]

    templates = [each.job["spec"]["template"]["metadata"]["labels"] for each in planned.replicas.values()]
    assert selected == {"palaestra.dev/job": "job"}
    assert all(selected.items() <= labels.items() for labels in templates)


def test_metrics_status_and_states_are_open_to_the_operator_and_to_monitoring(valid_job):
    """Only pods of the operator have access, not all pods of its namespace.

    ROS and control ports are open to no pod.
    """
    layout = ClusterLayout(images=IMAGES, operator_namespace="ops", monitoring_namespace="eyes")
    (rule,) = plan(valid_job(), layout).network_policy["spec"]["ingress"]

    assert rule["from"] == [
        {
            "namespaceSelector": {"matchLabels": {"kubernetes.io/metadata.name": "ops"}},
            "podSelector": {"matchLabels": {"palaestra.dev/operator": "true"}},
        },
        {"namespaceSelector": {"matchLabels": {"kubernetes.io/metadata.name": "eyes"}}},
    ]
    assert rule["ports"] == [
        {"protocol": "TCP", "port": 9090},
        {"protocol": "TCP", "port": 7200, "endPort": 7299},
    ]


def test_every_port_that_is_opened_is_one_that_a_container_declares(in_cluster):
    """A policy with other port numbers would block monitoring, although it looks right."""
    roles = {"collect": "Collect", "evaluate": "Evaluate"}
    planned = in_cluster(simulators=[{"name": name, "role": roles[name], "count": 16} for name in roles])
    spec = planned.replicas[0].job["spec"]["template"]["spec"]
    declared = {
        port["containerPort"]
        for container in (*spec["initContainers"], *spec["containers"])
        for port in container.get("ports", ())
    }

    opened = [
        range(port["port"], port.get("endPort", port["port"]) + 1)
        for port in policy(planned)["ingress"][0]["ports"]
    ]

    assert declared
    assert all(any(port in ports for ports in opened) for port in declared)


@pytest.mark.parametrize(
    ("network", "types", "egress"),
    [({}, ["Ingress"], None), ({"egress": "Closed"}, ["Ingress", "Egress"], [])],
)
def test_egress_is_free_unless_the_job_closes_it(in_cluster, network, types, egress):
    """A policy of type Egress without a rule would block all egress."""
    spec = policy(in_cluster(network=network))

    assert spec["policyTypes"] == types
    assert spec.get("egress") == egress


def test_a_job_that_is_made_again_has_a_policy_of_its_own(valid_job):
    """The policy's name contains the uid of its job.

    The old policy can be deleted at any time without harm to the new job.
    """
    layout = ClusterLayout(images=IMAGES)
    names = {
        plan(valid_job(uid=uid), layout).network_policy["metadata"]["name"] for uid in ("aaaa-1", "bbbb-1")
    }

    assert names == {"job-aaaa-1", "job-bbbb-1"}


def test_a_job_without_a_uid_has_no_policy(valid_job):
    """The owner reference needs the uid, and nobody would delete a policy without an owner."""
    job = valid_job()
    nobody = job.model_copy(update={"metadata": job.metadata.model_copy(update={"uid": None})})

    with pytest.raises(PlanError, match=r"^metadata.uid: "):
        plan(nobody, ClusterLayout(images=IMAGES))
