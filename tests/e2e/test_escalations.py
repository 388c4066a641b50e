"""A user who may write TrainingJobs but not create pods gains no further permission through TrainingJobs.

The user has only the role in manifests/examples/platform/roles.yaml. tests/e2e/escalations.py and
pod_metadata.py list every attempt with its possible gain, and these tests check the outcome. No pod has to
run for this check: every job is suspended, and the tests check the operator's objects.
"""

import itertools
from typing import NamedTuple

import pytest
import yaml

from tests.e2e.cluster import Object, Refused, path
from tests.e2e.escalations import HELD, REFUSED, REQUESTS, UNKNOWN, authors
from tests.e2e.jobs import make_claim
from tests.e2e.pod_metadata import METADATA
from tests.e2e.tour import somebody_s
from tests.jobs import EXAMPLES

ROLE, _, BINDING = yaml.safe_load_all((EXAMPLES / "platform" / "roles.yaml").read_text())
NAME = ROLE["metadata"]["name"]
THINGS = (
    ("persistentvolumeclaims", make_claim("kept")),
    ("secrets", {"metadata": {"name": "words"}, "stringData": {"word": "open"}}),
    ("configmaps", {"metadata": {"name": "settings"}, "data": {"text": "#VRML_SIM R2023b utf8\n"}}),
)
numbers = itertools.count()
TEXTS = (
    'a" } Robot { name "b',
    "a\nsimulators: []",
    "'; id #",
    "$(id) `id`",
    "{{ id }}",
    "- !!python/name:id",
    "\u2028\x85é",
)


def each(attempts):
    """Run a test with each attempt, and name the test after the attempt."""
    return pytest.mark.parametrize("attempt", attempts, ids=[attempt.name for attempt in attempts])


class Made(NamedTuple):
    """The operator's objects for a TrainingJob with one replica."""

    owner: Object
    job: Object
    config_map: Object

    @property
    def template(self) -> Object:
        """The template of the pods."""
        found: Object = self.job["spec"]["template"]
        return found

    @property
    def training(self) -> Object:
        """The parsed training.yaml."""
        read: Object = yaml.safe_load(self.config_map["data"]["training.yaml"])
        return read

    @property
    def trainer(self) -> Object:
        """The trainer's container."""
        [found] = self.template["spec"]["containers"]
        return found

    @property
    def simulator(self) -> Object:
        """The container of the only simulator."""
        found: Object = self.template["spec"]["initContainers"][-1]
        return found


@pytest.fixture(scope="module")
def author(cluster, shared):
    """The cluster as a user who may write TrainingJobs in the shared namespace sees it."""
    there = cluster.get("clusterroles", None, NAME) is not None
    if not there:
        cluster.create("clusterroles", ROLE)
    shared.create("rolebindings", {**BINDING, "metadata": {"name": "trainers"}})
    for kind, content in THINGS:
        shared.create(kind, content)
    with cluster.acting_as("somebody", "trainers") as reached:
        yield reached
    if not there:
        cluster.delete("clusterroles", None, NAME)


@pytest.fixture(scope="module")
def train(author, shared):
    """Return a function that creates a TrainingJob as the user; with `strict`, unknown fields are errors."""

    def create(job, *, strict=True):
        options = "?fieldValidation=Strict" if strict else "?fieldValidation=Ignore"
        return author.request("POST", path("trainingjobs", shared.name) + options, job)

    return create


@pytest.fixture(scope="module")
def planned(train, shared):
    """Return a function that creates a TrainingJob as the user and returns the operator's objects for it."""

    def make(job, *, strict=True):
        name = train(job, strict=strict)["metadata"]["name"]
        [batch] = shared.wait(lambda: shared.select("jobs", name))
        [config_map] = shared.select("configmaps", name)
        return Made(shared.get("trainingjobs", name), batch, config_map)

    return make


@pytest.fixture(scope="module")
def plain(planned):
    """The operator's objects for a job without special fields."""
    return planned(authors("plain"))


def nothing_is_left_to_see(planned):
    """Wait until the operator has planned a job that is newer than all others of the test."""
    planned(authors(f"later-{next(numbers)}"))


def unnamed(made):
    """Return the spec of the pods, in which `NAME` replaces the names that depend on the job."""
    text = yaml.safe_dump(made.template["spec"])
    for name in (
        made.owner["metadata"]["uid"],
        made.config_map["metadata"]["name"],
        made.owner["metadata"]["name"],
    ):
        text = text.replace(name, "NAME")
    return yaml.safe_load(text)


def test_the_author_trains(plain, author, shared):
    """The user can create a normal job, so a missing permission does not explain the refusals below."""
    assert plain.job["spec"]["suspend"] is True
    assert author.get("trainingjobs", shared.name, "plain")


@each(REQUESTS)
@pytest.mark.usefixtures("plain")
def test_a_request_past_the_trainingjob_is_forbidden(author, shared, attempt):
    """The role grants only TrainingJobs, without their status, so RBAC denies every other request."""
    with pytest.raises(Refused) as refused:
        author.request(attempt.method, attempt.where.format(namespace=shared.name), attempt.content)

    assert refused.value.code == 403, attempt.gain
    assert 'User "somebody" cannot' in refused.value.message


@each(REFUSED)
def test_a_value_that_would_open_something_is_refused(train, shared, attempt):
    """The API server rejects the TrainingJob, so no object is created and its author gains nothing.

    The message names the field.
    """
    name = f"refused-{REFUSED.index(attempt)}"

    with pytest.raises(Refused) as refused:
        train(authors(name, (attempt.path, attempt.value)))

    assert refused.value.code == 422
    assert attempt.told in refused.value.message, attempt.gain
    assert shared.get("trainingjobs", name) is None


@each(UNKNOWN)
def test_a_field_of_pods_is_none_of_a_trainingjob(train, planned, plain, attempt):
    """If a client is not strict, the API server drops the field, and the pods are those of a normal job."""
    name = f"unknown-{UNKNOWN.index(attempt)}"
    job = authors(name, (attempt.path, attempt.value))

    with pytest.raises(Refused, match="unknown field"):
        train(job)
    made = planned(job, strict=False)

    assert made.owner["spec"] == plain.owner["spec"]
    assert unnamed(made) == unnamed(plain), attempt.gain


@each((*HELD, *METADATA))
def test_what_nobody_has_opened_to_jobs_is_not_used(train, shared, attempt):
    """The operator holds the job even if the object is in the user's own namespace.

    It also holds jobs with metadata of pods that only other controllers read, because such metadata may grant
    permissions.
    """
    name = f"held-{(*HELD, *METADATA).index(attempt)}"
    train(authors(name, (attempt.path, attempt.value)))

    shared.wait(lambda: shared.condition(name, "Accepted").get("reason") == attempt.told)

    assert shared.select("jobs", name) == [], attempt.gain
    assert shared.select("configmaps", name) == [], attempt.gain


@pytest.mark.parametrize(
    ("field", "value"),
    [("spec.trainer.image", "mine:1"), ("spec.storage.existingClaim", "kept"), ("spec.managedBy", "a.b/c")],
)
def test_what_was_accepted_is_not_exchanged(author, shared, plain, field, value):
    """The operator checks these fields once, so a user must not replace the object after the check."""
    changed = authors("plain", (field, value))

    with pytest.raises(Refused, match="cannot be changed") as refused:
        author.patch("trainingjobs", shared.name, "plain", {"spec": changed["spec"]})

    assert refused.value.code == 422
    assert shared.get("jobs", "plain-0")["spec"]["template"] == plain.template


def test_an_affinity_holds_nothing_but_an_affinity(planned, plain):
    """The operator copies the affinity into the pod, so other pod fields inside it must be dropped."""
    pod = {"hostNetwork": True, "nodeName": "palaestra-control-plane", "containers": []}

    made = planned(authors("reaches-out", ("spec.scheduling.affinity", pod)))

    assert unnamed(made) == {**unnamed(plain), "affinity": {}}


def test_a_node_selector_goes_past_no_taint(planned, plain):
    """A job may select the node of the control plane, but its pods do not tolerate that node's taint."""
    selector = {"node-role.kubernetes.io/control-plane": ""}

    made = planned(authors("on-masters", ("spec.scheduling.nodeSelector", selector)))

    assert unnamed(made) == {**unnamed(plain), "nodeSelector": selector}
    assert "tolerations" not in unnamed(made)


def test_strings_stay_strings(planned, plain):
    """A text that is code for YAML, a shell or a template must reach the pod as plain text."""
    numbered = dict(enumerate(TEXTS))
    made = planned(
        authors(
            "written",
            ("spec.trainer.command", list(TEXTS)),
            ("spec.trainer.env", [{"name": f"TEXT_{n}", "value": text} for n, text in numbered.items()]),
            ("spec.trainer.algorithm.hyperparameters", {text: text for text in TEXTS}),
            ("spec.simulators.0.options", list(TEXTS)),
        )
    )

    kept = [text.replace("$", "$$") for text in TEXTS]  # a kubelet replaces `$$` by `$`
    environment = {variable["name"]: variable.get("value") for variable in made.trainer["env"]}
    assert {f"TEXT_{n}": text for n, text in enumerate(kept)}.items() <= environment.items()
    assert len(environment) == len(made.trainer["env"]) == len(plain.trainer["env"]) + len(TEXTS)
    assert made.trainer["command"] == kept
    assert [option for option in made.simulator["args"] if option.startswith("--option=")] == [
        f"--option={text}" for text in kept
    ]
    assert made.training.keys() == plain.training.keys()
    assert made.training["algorithm"]["hyperparameters"] == {text: text for text in TEXTS}
    assert [simulator["options"] for simulator in made.training["simulators"]] == [list(TEXTS)]
    assert made.config_map["data"].keys() == plain.config_map["data"].keys()


def test_metadata_reaches_no_object_of_the_operator(planned, plain, shared):
    """The operator trusts stop marks, owners and labels on its own objects, so a user must not set them."""
    job = authors("decorated")
    settings = shared.get("configmaps", "settings")["metadata"]
    stranger = {"apiVersion": "v1", "kind": "ConfigMap", "name": "settings", "uid": settings["uid"]}
    job["metadata"] |= {
        "annotations": {"palaestra.dev/stopped": "Stalled: now"},
        "labels": {"app": "database", "kueue.x-k8s.io/queue-name": "theirs"},
        "ownerReferences": [stranger],
    }
    job["status"] = {
        "phase": "Succeeded",
        "release": {"trainer": "mine:1", "stub": "mine:1", "mujoco": "mine:1", "webots": "mine:1"},
    }

    made = planned(job, strict=False)

    for child in (made.job, made.config_map):
        [owner] = child["metadata"]["ownerReferences"]
        assert (owner["kind"], owner["uid"]) == ("TrainingJob", made.owner["metadata"]["uid"])
        assert not child["metadata"]["labels"].keys() & job["metadata"]["labels"].keys()
    assert not made.job["metadata"].get("annotations", {}).keys() & job["metadata"]["annotations"].keys()
    assert made.template["metadata"]["labels"].keys() == plain.template["metadata"]["labels"].keys()
    assert unnamed(made) == unnamed(plain)
    assert made.owner["status"].get("phase") != "Succeeded"


def test_a_job_of_somebody_else_is_left_alone(train, shared):
    """An author could give a TrainingJob such a name that its Job has the name of another user's Job."""
    theirs = shared.create("jobs", somebody_s("theirs-0"))

    train(authors("theirs", ("spec.suspend", False)))
    shared.wait(lambda: "NameTaken" in shared.reasons("theirs"))

    assert shared.get("jobs", "theirs-0")["metadata"]["generation"] == theirs["metadata"]["generation"]
    assert shared.get("jobs", "theirs-0")["metadata"]["uid"] == theirs["metadata"]["uid"]


@pytest.fixture
def held(author, planned, shared):
    """A deleted TrainingJob that its author's finalizer keeps until the test ends."""
    job = authors("held")
    job["metadata"]["finalizers"] = ["example.com/mine"]
    planned(job)
    author.delete("trainingjobs", shared.name, "held")
    yield
    author.request("PATCH", path("trainingjobs", shared.name, "held"), {"metadata": {"finalizers": None}})


@pytest.mark.usefixtures("held")
def test_a_finalizer_brings_a_deleted_job_no_more_pods(planned, shared):
    """A user could otherwise run pods for a deleted job for as long as the finalizer stays.

    The operator watches TrainingJobs and Jobs separately. It must receive the first deletion before the
    second, or it creates the Job again once.
    """
    nothing_is_left_to_see(planned)
    shared.cluster.delete("jobs", shared.name, "held-0")
    nothing_is_left_to_see(planned)

    assert shared.select("jobs", "held") == []


def test_a_job_of_another_controller_is_not_planned(train, planned, shared):
    """Another controller may plan this job. The operator must not create objects for it as well."""
    train(authors("spoofed", ("spec.managedBy", "example.com/other")))
    nothing_is_left_to_see(planned)

    assert shared.get("trainingjobs", "spoofed")["status"]["observedGeneration"] == 0
    assert shared.select("jobs", "spoofed") == []
