"""If an object is refused, is missing or may not be used by jobs, the status shows the reason."""

import json
from http import HTTPStatus
from pathlib import Path

import pytest
import yaml

from palaestra.cluster import Forbidden, Invalid, Resource
from palaestra.cluster.resources import DEFINITIONS, JOBS, PODS, SECRETS, TRAINING_JOBS
from palaestra.operator.options import DEFAULT_NAMESPACE as NAMESPACE
from palaestra.operator.options import NAME
from tests.chart.installation import SECRETS_ROLE
from tests.integration.operator.cluster import local_queues
from tests.integration.operator.installed import USER
from tests.waiting import eventually

PLATFORM = Path(__file__).parents[3] / "manifests" / "examples" / "platform"
QUOTAS = Resource(api_version="v1", kind="ResourceQuota", plural="resourcequotas")
LIMITS = Resource(api_version="v1", kind="LimitRange", plural="limitranges")
ADMISSION = "admissionregistration.k8s.io/v1"
POLICIES = Resource(
    api_version=ADMISSION, kind="ValidatingAdmissionPolicy", plural="validatingadmissionpolicies"
)
POLICY_BINDINGS = Resource(
    api_version=ADMISSION, kind="ValidatingAdmissionPolicyBinding", plural="validatingadmissionpolicybindings"
)
BINDINGS = Resource(api_version="rbac.authorization.k8s.io/v1", kind="RoleBinding", plural="rolebindings")
TOKEN = {"name": "TOKEN", "secretKeyRef": {"name": "token", "key": "token"}}
SECRET = {
    "apiVersion": "v1",
    "kind": "Secret",
    "metadata": {"name": "token", "labels": {"palaestra.dev/for-jobs": "true"}},
    "stringData": {"token": "x"},
}


def quota(**hard):
    """Return a quota that allows none of the given resources."""
    limits = {name.replace("_", "."): "0" for name in hard}
    return {
        "apiVersion": "v1",
        "kind": "ResourceQuota",
        "metadata": {"name": "none-left"},
        "spec": {"hard": limits},
    }


def limited(place, obj):
    """Create a quota, and wait until the API server enforces it."""
    place.create(QUOTAS, obj)
    eventually(lambda: place.get(QUOTAS, "none-left").get("status", {}).get("hard"))


def test_the_status_quotes_the_api_server_that_refuses_pods(place, start):
    """Users look at the status of their job and not at the events of its Jobs."""
    limited(place, quota(pods=True))
    start()

    place.train()

    [replica] = eventually(lambda: [it for it in place.status().get("replicas", ()) if refused(it)])
    assert "exceeded quota: none-left" in replica["message"]


def refused(replica):
    """Return whether the status of a replica reports refused pods."""
    return replica.get("reason") == "PodsRefused"


def test_the_quota_of_the_examples_bounds_the_training_jobs_of_a_namespace(place):
    """The API server refuses a further job at once, so the operator need not stop it."""
    example, *_ = yaml.safe_load_all((PLATFORM / "quota.yaml").read_text())
    [counted] = [name for name in example["spec"]["hard"] if name.startswith("count/")]
    few = {"apiVersion": "v1", "kind": "ResourceQuota", "metadata": {"name": "few"}}
    place.create(QUOTAS, few | {"spec": {"hard": {counted: "1"}}})
    eventually(lambda: place.get(QUOTAS, "few").get("status", {}).get("hard") == {counted: "1"}, 60)
    place.train("first")

    with pytest.raises(Forbidden, match=f"exceeded quota: few, requested: {counted}=1"):
        place.train("second")


def pod(name, **spec):
    """Return a pod as another controller creates it; keywords are fields of its spec."""
    containers = [{"name": "main", "image": "theirs"}]
    return {
        "apiVersion": "v1",
        "kind": "Pod",
        "metadata": {"name": name},
        "spec": {"containers": containers, **spec},
    }


def pod_apart(name, **term):
    """Return a pod with a required anti-affinity."""
    terms = [{"topologyKey": "kubernetes.io/os", "labelSelector": {}, **term}]
    return pod(name, affinity={"podAntiAffinity": {"requiredDuringSchedulingIgnoredDuringExecution": terms}})


def test_the_quota_of_the_examples_refuses_an_affinity_to_other_namespaces(place):
    """The quota applies to the pods of all controllers.

    The operator's own check applies only to TrainingJobs.
    """
    _, example, _ = yaml.safe_load_all((PLATFORM / "quota.yaml").read_text())
    place.create(QUOTAS, {**example, "metadata": {"name": "none-left"}})
    eventually(lambda: place.get(QUOTAS, "none-left").get("status", {}).get("hard"))
    place.create(PODS, pod_apart("within"))

    with pytest.raises(Forbidden, match="exceeded quota: none-left"):
        place.create(PODS, pod_apart("beyond", namespaceSelector={}))


OF_OTHERS = {"matchExpressions": [{"key": "palaestra.dev/job", "operator": "Exists"}]}
ALONE = {"requiredDuringSchedulingIgnoredDuringExecution": [
    {"topologyKey": "kubernetes.io/hostname", "labelSelector": OF_OTHERS}
]}  # fmt: skip


def test_what_affects_others_waits_until_it_is_allowed_and_stays_when_it_no_longer_is(place, start):
    """After an upgrade with stricter rules, an accepted job must still get new pods."""
    scheduling = {"affinity": {"podAntiAffinity": ALONE}, "runtimeClassName": "kata"}
    first = start("--allow-runtime-class=kata")
    place.train(scheduling=scheduling)
    eventually(lambda: place.condition("Accepted").get("reason") == "SchedulingNotAllowed")
    assert place.all(JOBS, "job") == []
    first.kill()

    second = start("--allow-runtime-class=kata", "--allow-anti-affinity-label=palaestra.dev/job")
    [job] = eventually(lambda: place.all(JOBS, "job"))
    second.kill()
    place.api.delete(JOBS, place.name, job["metadata"]["name"])
    start()
    [again] = eventually(lambda: [it for it in place.all(JOBS, "job") if uid(it) != uid(job)], 60)

    assert place.condition("Accepted")["status"] == "True"
    assert again["spec"]["template"]["spec"]["affinity"] == {"podAntiAffinity": ALONE}


def uid(found):
    """Return the uid of an object."""
    return found["metadata"]["uid"]


# OpenShift's constraint restricted-v2 refuses users outside of the namespace's range of ids.
RANGE = "must be in the ranges: [1000660000, 1000669999]"
LIKE_OPENSHIFT = {
    "apiVersion": "admissionregistration.k8s.io/v1",
    "kind": "ValidatingAdmissionPolicy",
    "spec": {
        "matchConstraints": {
            "resourceRules": [
                {"apiGroups": [""], "apiVersions": ["v1"], "operations": ["CREATE"], "resources": ["pods"]}
            ]
        },
        "validations": [
            {
                "expression": "!has(object.spec.securityContext) || "
                "(!has(object.spec.securityContext.runAsUser) && !has(object.spec.securityContext.fsGroup))",
                "message": RANGE,
            }
        ],
    },
}


def user_is_refused(place):
    """Return whether the API server refuses a pod that names a user by now."""
    of_a_user = pod("of-a-user", securityContext={"runAsUser": 1000})
    of_a_user["metadata"]["namespace"] = place.name
    try:
        place.api.create(PODS, of_a_user, dry_run=True)
    except Invalid as refusal:
        return RANGE in str(refusal)
    return False


@pytest.fixture
def like_openshift(place):
    """Make the API server refuse pods of this namespace that name a user, as OpenShift does."""
    name = f"like-openshift-{place.name}"
    chosen = {"namespaceSelector": {"matchLabels": {"kubernetes.io/metadata.name": place.name}}}
    place.api.create(POLICIES, LIKE_OPENSHIFT | {"metadata": {"name": name}})
    place.api.create(
        POLICY_BINDINGS,
        {
            "apiVersion": POLICIES.api_version,
            "kind": "ValidatingAdmissionPolicyBinding",
            "metadata": {"name": name},
            "spec": {"policyName": name, "validationActions": ["Deny"], "matchResources": chosen},
        },
    )
    # The API server enforces a policy only some time after it has stored the policy.
    eventually(lambda: user_is_refused(place), 60)
    yield
    place.api.delete(POLICY_BINDINGS, None, name)
    place.api.delete(POLICIES, None, name)


@pytest.mark.usefixtures("like_openshift")
def test_pods_run_where_the_cluster_chooses_their_user(place, start):
    """Such a cluster refuses the fixed user of our images, so an installation can leave this user out."""
    operator = start()
    place.train("named")
    eventually(lambda: RANGE in str(place.status("named").get("replicas", "")), 60)
    operator.stop()

    start("--no-fixed-user")
    place.train("chosen")

    assert place.pods("chosen")


SIZES = {"requests": {"cpu": "100m", "memory": "128Mi"}, "limits": {"cpu": "200m", "memory": "256Mi"}}
FLOOR = {"type": "Container", "min": SIZES["requests"], "maxLimitRequestRatio": {"memory": "2"}}
HARD = {"requests.cpu": "8", "limits.cpu": "16", "requests.memory": "16Gi", "limits.memory": "32Gi"}


def confined(place):
    """Make the API server refuse containers without limits, with small requests or with uneven limits."""
    place.create(
        LIMITS,
        {
            "apiVersion": "v1",
            "kind": "LimitRange",
            "metadata": {"name": "floor"},
            "spec": {"limits": [FLOOR]},
        },
    )
    limited(place, quota() | {"spec": {"hard": HARD}})


def test_a_job_fits_a_namespace_with_limits_by_fields_of_its_own(place, start):
    """The author must be able to set resources for every container, including the ROS master.

    If one container has no limits, the namespace refuses the pod forever.
    """
    confined(place)
    start()
    groups = [{"name": name, "role": name.title(), "resources": SIZES} for name in ("collect", "evaluate")]

    place.train(simulators=groups, trainer={"resources": SIZES}, rosMaster={"resources": SIZES})

    assert place.pods()


def test_the_shortest_job_fits_a_namespace_with_limits_by_the_installation(place, start):
    """The author of `helm test` or of a first example does not know the limits of the namespace."""
    confined(place)
    start(*(f"--{each}-resources={json.dumps(SIZES)}" for each in ("ros-master", "simulator", "trainer")))

    place.train()

    assert place.pods()


def test_a_refused_claim_is_reported_and_made_when_there_is_room(place, start):
    """A namespace's quota of volumes is often smaller than its quota of pods."""
    limited(place, quota(persistentvolumeclaims=True))
    start()
    place.train()
    eventually(lambda: "PodsRefused" in place.events())
    assert place.status()["replicas"][0]["reason"] == "PodsRefused"
    assert "exceeded quota: none-left" in place.condition("Running")["message"]
    assert place.all(JOBS, "job") == []
    assert "Planned" not in {each["reason"] for each in place.about() if "Job" in each["message"]}

    place.api.delete(QUOTAS, place.name, "none-left")

    assert place.pods(deadline_s=60)


def test_no_secret_is_looked_at_where_nobody_allowed_it(place, start, installed):
    """RBAC cannot select Secrets by label, so the operator reads them only where a RoleBinding allows it."""
    start()
    place.create(SECRETS, SECRET)
    place.train(trainer={"env": [TOKEN]})
    eventually(lambda: place.condition("Accepted").get("reason") == "SecretNotForJobs")

    open_secrets(installed, place)

    [pod] = place.pods(deadline_s=60)
    assert "valueFrom" in str(pod["spec"]["containers"][0]["env"])


def test_a_pull_secret_needs_the_label_and_is_looked_at_where_somebody_allowed_it(place, start, installed):
    """Without this rule, an author could run and read private images without the consent of their owner."""
    open_secrets(installed, place)
    place.create(SECRETS, {**SECRET, "metadata": {"name": "token"}})
    start()
    place.train(imagePullSecrets=[{"name": "token"}])
    eventually(lambda: place.condition("Accepted").get("reason") == "SecretNotForJobs")
    assert place.all(JOBS, "job") == []

    place.api.merge(SECRETS, place.name, "token", {"metadata": {"labels": SECRET["metadata"]["labels"]}})

    [job] = eventually(lambda: place.all(JOBS, "job"), 60)
    assert job["spec"]["template"]["spec"]["imagePullSecrets"] == [{"name": "token"}]


def test_the_content_of_a_secret_is_never_asked_for(place, start, installed, control_plane):
    """Content that the operator never reads cannot leak.

    The API server's audit log must show only responses with metadata.
    """
    open_secrets(installed, place)
    place.create(SECRETS, SECRET)
    start()
    place.train(trainer={"env": [TOKEN]})
    place.pods(deadline_s=60)

    asked = [
        each
        for each in control_plane.audit(place.name)
        if each["user"].get("username") == USER
        and {"resource": "secrets", "namespace": place.name}.items() <= each.get("objectRef", {}).items()
    ]
    answers = [each["responseObject"] for each in asked if each["responseStatus"]["code"] == HTTPStatus.OK]
    assert {(each["verb"], each["objectRef"]["name"]) for each in asked} == {("get", "token")}
    assert {answer["kind"] for answer in answers} == {"PartialObjectMetadata"}
    assert "data" not in set().union(*answers)


def open_secrets(installed, place):
    """Bind the role that reads Secrets to the operator, as an administrator does in a namespace."""
    installed.create(
        BINDINGS,
        {
            "apiVersion": BINDINGS.api_version,
            "kind": BINDINGS.kind,
            "metadata": {"name": SECRETS_ROLE, "namespace": place.name},
            "roleRef": {"apiGroup": "rbac.authorization.k8s.io", "kind": "ClusterRole", "name": SECRETS_ROLE},
            "subjects": [{"kind": "ServiceAccount", "name": NAME, "namespace": NAMESPACE}],
        },
    )


@pytest.fixture
def kueue(installed):
    """Make the cluster look as if it had Kueue; the test acts as Kueue."""
    installed.create(DEFINITIONS, local_queues())
    eventually(lambda: installed.serves("kueue.x-k8s.io"))
    yield
    installed.delete(DEFINITIONS, None, "localqueues.kueue.x-k8s.io")
    eventually(lambda: not installed.serves("kueue.x-k8s.io"))


def test_a_queue_without_kueue_is_reported_until_kueue_is_there(place, start, request):
    """Without Kueue the job stays suspended, so the user must see the reason."""
    start()
    place.train(scheduling={"queueName": "robots"})
    eventually(lambda: place.condition("Accepted").get("reason") == "NoKueue")
    assert place.all(JOBS, "job") == []

    request.getfixturevalue("kueue")

    eventually(lambda: place.get(JOBS, "job-0"), deadline_s=60)


@pytest.mark.usefixtures("kueue")
def test_what_kueue_does_to_a_job_is_never_undone(place, start):
    """Only Kueue decides whether such a Job is suspended, and on which nodes its pods may run."""
    operator = start()
    place.train(scheduling={"queueName": "robots"})
    eventually(lambda: place.get(JOBS, "job-0"))
    place.until("Suspended")
    assert place.get(JOBS, "job-0")["metadata"]["labels"]["kueue.x-k8s.io/queue-name"] == "robots"

    nodes = {"template": {"spec": {"nodeSelector": {"flavour": "large"}}}}
    place.api.merge(JOBS, place.name, "job-0", {"spec": {"suspend": False, **nodes}})
    [pod] = place.pods()
    place.run(pod)
    place.until("Running")
    place.api.merge(JOBS, place.name, "job-0", {"spec": {"suspend": True}})
    place.until("Suspended")

    assert place.get(JOBS, "job-0")["spec"]["suspend"] is True
    assert place.get(JOBS, "job-0")["spec"]["template"]["spec"]["nodeSelector"] == {"flavour": "large"}
    assert operator.said("suspended") == operator.said("resumed") == []


@pytest.mark.parametrize("field", ["seed", "replicas"])
def test_the_api_server_refuses_to_change_a_running_job(field, place, start):
    """A user prolongs a run with a new job, because a change of this job would falsify its result."""
    start()
    place.train()
    [pod] = place.pods()

    with pytest.raises(Exception, match=field):
        place.api.merge(TRAINING_JOBS, place.name, "job", {"spec": {field: 7}})

    assert [each["metadata"]["uid"] for each in place.all(PODS, "job")] == [pod["metadata"]["uid"]]
