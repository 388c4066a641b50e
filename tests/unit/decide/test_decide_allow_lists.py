"""A job may set fields that affect only its own pods.

An administrator must allow each field that affects pods of other users.
"""

from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra.api import validate
from palaestra.api.status import Phase
from palaestra.decide.allow_lists import PREFERRED, REQUIRED, not_allowed
from palaestra.plan import Allowed
from tests.jobs import make_job

OWN = {"matchLabels": {"palaestra.dev/job": "job"}}
TERM = f"affinity.podAntiAffinity.{PREFERRED}[0].podAffinityTerm"
OF_OTHERS = f"affinity.podAntiAffinity.{REQUIRED}[0].labelSelector"
SELECT_OWN = (
    "create a new TrainingJob that selects its own pods by palaestra.dev/job: job, or allow a label of the "
    "selector with the chart's value jobs.allowedAntiAffinityLabels"
)
EVERYBODY = {"labelSelector": {}, "namespaceSelector": {}, "topologyKey": "kubernetes.io/os"}
GPU = {"key": "nvidia.com/gpu", "operator": "Exists"}


def required(kind, **term):
    """Return scheduling with one required term."""
    return {"affinity": {kind: {REQUIRED: [{"topologyKey": "kubernetes.io/hostname", **term}]}}}


def preferred(kind, **term):
    """Return scheduling with one preferred term."""
    term = {"topologyKey": "kubernetes.io/hostname", **term}
    return {"affinity": {kind: {PREFERRED: [{"weight": 100, "podAffinityTerm": term}]}}}


def expressions(key, operator, *values):
    """Return a selector with one expression."""
    return {
        "matchExpressions": [
            {"key": key, "operator": operator, **({"values": list(values)} if values else {})}
        ]
    }


def allow(value):
    """Return the remedy that names one of the chart's values."""
    return f"allow it with the chart's value jobs.{value}, or create a new TrainingJob without it"


# Fields that an administrator must allow: scheduling, the value that allows it, field and fact, and remedy.
REFUSED = {
    "a priority": (
        {"priorityClassName": "urgent"},
        Allowed(priority_classes=("urgent",)),
        "priorityClassName: priority class urgent",
        allow("allowedPriorityClasses"),
    ),
    "a runtime": (
        {"runtimeClassName": "nvidia"},
        Allowed(runtime_classes=("nvidia",)),
        "runtimeClassName: runtime class nvidia",
        allow("allowedRuntimeClasses"),
    ),
    "nodes that are reserved": (
        {"tolerations": [{"key": "dedicated", "value": "other-team"}]},
        Allowed(tolerations=("dedicated",)),
        "tolerations[0]: toleration of taint dedicated",
        allow("allowedTolerations"),
    ),
    "nodes with GPUs, for a job that requests none": (
        {"tolerations": [GPU]},
        Allowed(tolerations=("nvidia.com/",)),
        "tolerations[0]: toleration of taint nvidia.com/gpu",
        allow("allowedTolerations"),
    ),
    "nodes near pods of others": (
        required("podAffinity", namespaces=["default", "storage"], labelSelector={}),
        Allowed(affinity_namespaces=("storage",)),
        f"affinity.podAffinity.{REQUIRED}[0].namespaces: affinity to pods of namespace storage",
        allow("allowedAffinityNamespaces"),
    ),
    "nodes far from pods of others, if possible": (
        preferred("podAntiAffinity", namespaces=["storage"], labelSelector={}),
        Allowed(affinity_namespaces=("storage",)),
        f"{TERM}.namespaces: affinity to pods of namespace storage",
        allow("allowedAffinityNamespaces"),
    ),
    "a node for itself in its namespace": (
        required("podAntiAffinity", labelSelector={}),
        None,
        f"{OF_OTHERS}: a required anti-affinity to pods of other jobs",
        SELECT_OWN,
    ),
    "a node without other trainings": (
        required("podAntiAffinity", labelSelector=expressions("palaestra.dev/job", "Exists")),
        Allowed(anti_affinity_labels=("palaestra.dev/job",)),
        f"{OF_OTHERS}: a required anti-affinity to pods of other jobs",
        SELECT_OWN,
    ),
    "the cluster without other tenants": (
        {"affinity": {"podAntiAffinity": {REQUIRED: [EVERYBODY]}}},
        None,
        f"affinity.podAntiAffinity.{REQUIRED}[0].namespaceSelector: an affinity to selected namespaces",
        "create a new TrainingJob that names the namespaces",
    ),
}
FREE = {
    "its replicas apart, if possible": preferred(
        "podAntiAffinity", labelSelector=expressions("palaestra.dev/job", "In", "spread")
    ),
    "its replicas apart": required("podAntiAffinity", labelSelector=OWN),
    "its replicas apart, by an expression": required(
        "podAntiAffinity", labelSelector=expressions("palaestra.dev/job", "In", "job")
    ),
    "its replicas apart, by the key": required(
        "podAntiAffinity", labelSelector={}, matchLabelKeys=["palaestra.dev/job-uid"]
    ),
    "its replicas in zones of their own": required(
        "podAntiAffinity", labelSelector=OWN, topologyKey="topology.kubernetes.io/zone"
    ),
    "apart from no pods": required("podAntiAffinity"),
    "near pods of its namespace": required("podAffinity", labelSelector={}, namespaces=["default"]),
    "one of some nodes": {
        "affinity": {
            "nodeAffinity": {
                REQUIRED: {
                    "nodeSelectorTerms": [{"matchExpressions": [{"key": "gpu", "operator": "Exists"}]}]
                }
            }
        }
    },
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_affects_others_is_held_with_its_field_and_the_value_that_allows_it(make_scene, name):
    """If the author lacks the permission to create such pods, the operator must not create them for her."""
    scheduling, _, fact, remedy = REFUSED[name]
    scene = make_scene(scheduling=scheduling)

    decision = scene.settle()

    [accepted, *_] = scene.status.conditions
    assert (scene.status.phase, accepted.status, decision.actions) == (Phase.PENDING, "False", ())
    assert accepted.reason == "SchedulingNotAllowed"
    assert accepted.message == f"spec.scheduling.{fact} is not allowed in this cluster; {remedy}"


@pytest.mark.parametrize("name", [name for name, (_, allowed, *_) in REFUSED.items() if allowed])
def test_what_the_installation_allows_starts_the_job(make_scene, name):
    """An administrator sets the chart's value, which restarts the operator.

    The new operator must start the held job.
    """
    scheduling, allowed, *_ = REFUSED[name]
    scene = make_scene(scheduling=scheduling)
    scene.settle()
    scene.layout = replace(scene.layout, allowed=allowed)

    decision = scene.settle()

    assert decision.actions[-1].object["kind"] == "Job"


@pytest.mark.parametrize("name", FREE)
def test_what_a_job_asks_for_itself_is_free(make_scene, name):
    """The documentation of Kubernetes recommends these fields, and they affect only the job's own pods."""
    scene = make_scene(scheduling=FREE[name])

    decision = scene.settle()

    pod = decision.actions[-1].object["spec"]["template"]["spec"]
    assert pod["affinity"] == FREE[name]["affinity"]


@pytest.mark.parametrize(
    ("resources", "free"),
    [
        ({"limits": {"nvidia.com/gpu": 1}}, True),
        ({"requests": {"nvidia.com/gpu": 1}}, True),
        ({"limits": {"nvidia.com/gpu": 0}}, False),
        ({"limits": {"amd.com/gpu": 1}}, False),
    ],
)
def test_a_job_that_requests_a_gpu_tolerates_the_taint_of_nodes_with_gpus(make_scene, resources, free):
    """Kubernetes' plugin ExtendedResourceToleration adds the same toleration, so no permission is needed."""
    scene = make_scene(scheduling={"tolerations": [GPU]}, trainer={"resources": resources})

    scene.settle()

    assert (scene.status.conditions[0].status == "True") is free


@pytest.mark.parametrize("key", ["node.kubernetes.io/unschedulable", "memory"])
def test_a_resource_of_every_node_opens_no_taint(make_scene, key):
    """Every node satisfies such a request, so the request does not show that the pod needs a special node."""
    asks = {"resources": {"requests": {key: "1"}}}
    scene = make_scene(scheduling={"tolerations": [{"key": key, "operator": "Exists"}]}, trainer=asks)

    scene.settle()

    assert scene.status.conditions[0].reason == "SchedulingNotAllowed"


@pytest.mark.parametrize(
    "selector",
    [
        {"matchLabels": {"palaestra.dev/job": "other"}},
        expressions("palaestra.dev/job", "In", "job", "other"),
        expressions("palaestra.dev/job", "NotIn", "job"),
        expressions("palaestra.dev/replica", "Exists"),
        expressions("example.com/team", "NotIn", "robots"),
        "text",
    ],
)
def test_a_selector_of_pods_of_others_is_refused(make_scene, selector):
    """The installation allows the label example.com/team, but these selectors also match pods without it."""
    scene = make_scene(scheduling=required("podAntiAffinity", labelSelector=selector))
    scene.layout = replace(scene.layout, allowed=Allowed(anti_affinity_labels=("example.com/team",)))

    scene.settle()

    assert scene.status.conditions[0].reason == "SchedulingNotAllowed"


@pytest.mark.parametrize(
    "scheduling",
    [
        required("podAffinity", namespaces=["", "storage"], labelSelector={}),
        required("podAffinity", namespaces=[0, "storage"], labelSelector={}),
        {"podAnnotations": {"": "", "iam.amazonaws.com/role": "admin"}},
    ],
)
def test_an_empty_name_hides_no_other(make_scene, scheduling):
    """An empty value must not make the check skip the other values.

    The API server refuses such a pod today, but the check must not depend on that.
    """
    scene = make_scene(scheduling=scheduling)

    scene.settle()

    assert scene.status.conditions[0].reason in {"SchedulingNotAllowed", "PodMetadataNotAllowed"}


VALUES = st.recursive(
    st.none() | st.booleans() | st.integers(0, 9) | st.text(max_size=3),
    lambda inner: st.lists(inner, max_size=3)
    | st.dictionaries(
        st.sampled_from(
            [REQUIRED, PREFERRED, "podAffinityTerm", "labelSelector", "matchExpressions", "matchLabels",
             "matchLabelKeys", "namespaces", "key", "operator", "values"]
        ),
        inner,
        max_size=3,
    ),
    max_leaves=12,
)  # fmt: skip


@given(st.dictionaries(st.sampled_from(["podAffinity", "podAntiAffinity"]), VALUES, max_size=2))
def test_no_affinity_breaks_the_check(affinity):
    """An affinity is a free object, so its values may have any type. None of them may crash the operator."""
    job = validate(make_job(scheduling={"affinity": affinity}))

    not_allowed(job, Allowed())
