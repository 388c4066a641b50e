"""A user may write TrainingJobs but create no pods, and must gain no other permission by them.

The user has only the role in manifests/examples/platform/roles.yaml. Each attempt is in
tests/e2e/escalations.py with its possible gain; these tests check the outcome. Nothing has to run for that:
every job is suspended, and the operator's objects are checked.
"""

import itertools
from typing import NamedTuple

import pytest
import yaml

from tests.e2e.cluster import Object, Refused, path
from tests.e2e.escalations import HELD, METADATA, REFUSED, REQUESTS, UNKNOWN, authors
from tests.e2e.jobs import make_claim
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
    """Run a test with every attempt, by name."""
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
    """The cluster as seen by a user who may write TrainingJobs in the shared namespace."""
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
    """Create a TrainingJob as the author; `strict` refuses unknown fields."""

    def create(job, *, strict=True):
        options = "?fieldValidation=Strict" if strict else "?fieldValidation=Ignore"
        return author.request("POST", path("trainingjobs", shared.name) + options, job)

    return create


@pytest.fixture(scope="module")
def planned(train, shared):
    """Create a TrainingJob as the author, and return the operator's objects for it."""

    def make(job, *, strict=True):
        name = train(job, strict=strict)["metadata"]["name"]
        [batch] = shared.wait(lambda: shared.select("jobs", name))
        [config_map] = shared.select("configmaps", name)
        return Made(shared.get("trainingjobs", name), batch, config_map)

    return make


@pytest.fixture(scope="module")
def plain(planned):
    """The objects of a normal job."""
    return planned(authors("plain"))


def nothing_is_left_to_see(planned):
    """Return when the operator has planned a job that was created after everything else."""
    planned(authors(f"later-{next(numbers)}"))


def unnamed(made):
    """Return the spec of the pods without the names that differ between two jobs."""
    text = yaml.safe_dump(made.template["spec"])
    for name in (
        made.owner["metadata"]["uid"],
        made.config_map["metadata"]["name"],
        made.owner["metadata"]["name"],
    ):
        text = text.replace(name, "NAME")
    return yaml.safe_load(text)


def test_the_author_trains(plain, author, shared):
    """This is the control: without it, a missing permission could explain every refusal below."""
    assert plain.job["spec"]["suspend"] is True
    assert author.get("trainingjobs", shared.name, "plain")


@each(REQUESTS)
@pytest.mark.usefixtures("plain")
def test_a_request_past_the_trainingjob_is_forbidden(author, shared, attempt):
    """The role grants only TrainingJobs, and not their status."""
    with pytest.raises(Refused) as refused:
        author.request(attempt.method, attempt.where.format(namespace=shared.name), attempt.content)

    assert refused.value.code == 403, attempt.gain
    assert 'User "somebody" cannot' in refused.value.message


@each(REFUSED)
def test_a_value_that_would_open_something_is_refused(train, shared, attempt):
    """The API server refuses it with the field, before any object is made."""
    name = f"refused-{REFUSED.index(attempt)}"

    with pytest.raises(Refused) as refused:
        train(authors(name, (attempt.path, attempt.value)))

    assert refused.value.code == 422
    assert attempt.told in refused.value.message, attempt.gain
    assert shared.get("trainingjobs", name) is None


@each(UNKNOWN)
def test_a_field_of_pods_is_none_of_a_trainingjob(train, planned, plain, attempt):
    """A client that is not strict drops the field; the pods are those of any job."""
    name = f"unknown-{UNKNOWN.index(attempt)}"
    job = authors(name, (attempt.path, attempt.value))

    with pytest.raises(Refused, match="unknown field"):
        train(job)
    made = planned(job, strict=False)

    assert made.owner["spec"] == plain.owner["spec"]
    assert unnamed(made) == unnamed(plain), attempt.gain


@each((*HELD, *METADATA))
def test_what_nobody_has_opened_to_jobs_is_not_used(train, shared, attempt):
    """This holds even in the author's own namespace, and for a text that only other controllers use."""
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
    """Otherwise an object that was checked could be replaced afterwards."""
    changed = authors("plain", (field, value))

    with pytest.raises(Refused, match="cannot be changed") as refused:
        author.patch("trainingjobs", shared.name, "plain", {"spec": changed["spec"]})

    assert refused.value.code == 422
    assert shared.get("jobs", "plain-0")["spec"]["template"] == plain.template


def test_an_affinity_holds_nothing_but_an_affinity(planned, plain):
    """The affinity is passed on unchanged, so it might have an effect elsewhere."""
    pod = {"hostNetwork": True, "nodeName": "palaestra-control-plane", "containers": []}

    made = planned(authors("reaches-out", ("spec.scheduling.affinity", pod)))

    assert unnamed(made) == {**unnamed(plain), "affinity": {}}


def test_a_node_selector_goes_past_no_taint(planned, plain):
    """A job may select the control plane's node, but does not tolerate its taint."""
    selector = {"node-role.kubernetes.io/control-plane": ""}

    made = planned(authors("on-masters", ("spec.scheduling.nodeSelector", selector)))

    assert unnamed(made) == {**unnamed(plain), "nodeSelector": selector}
    assert "tolerations" not in unnamed(made)


def test_strings_stay_strings(planned, plain):
    """This holds whatever they mean to YAML, to a shell or to a template."""
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

    kept = [text.replace("$", "$$") for text in TEXTS]  # a kubelet reads two of them as one
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
    """A stop mark, an owner or a label would be trusted on the operator's own objects."""
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
    """A TrainingJob's name may give its Job the name of somebody else's."""
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
    """This holds however long its author keeps it.

    The operator watches TrainingJobs and Jobs separately: the first deletion must reach it before the second,
    or it replaces the Job once.
    """
    nothing_is_left_to_see(planned)
    shared.cluster.delete("jobs", shared.name, "held-0")
    nothing_is_left_to_see(planned)

    assert shared.select("jobs", "held") == []


def test_a_job_of_another_controller_is_not_planned(train, planned, shared):
    """A user gains nothing by naming another controller."""
    train(authors("spoofed", ("spec.managedBy", "example.com/other")))
    nothing_is_left_to_see(planned)

    assert shared.get("trainingjobs", "spoofed")["status"]["observedGeneration"] == 0
    assert shared.select("jobs", "spoofed") == []
