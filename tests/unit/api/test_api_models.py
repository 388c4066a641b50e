"""A minimal TrainingJob: its defaults and its absent fields."""

import pytest
from pydantic import ValidationError

from palaestra.api import Driver, Metadata, Role, SimulatorGroup, Spec, TrainingJob, validate
from palaestra.errors import SpecErrors

NOON = "2026-01-31T12:00:00Z"


@pytest.fixture
def least(job_data) -> TrainingJob:
    """Return a job that sets only its two groups."""
    return validate(job_data())


def test_a_job_without_a_spec_collects_and_evaluates() -> None:
    """The smallest job that can learn has one simulator for each role."""
    job = TrainingJob(metadata=Metadata(name="least"), spec=Spec())

    assert [(group.name, group.role, group.count) for group in job.spec.simulators] == [
        ("collect", Role.COLLECT, 1),
        ("evaluate", Role.EVALUATE, 1),
    ]


def test_a_group_is_of_stubs_in_the_arena(least) -> None:
    """A first run works without an installed simulator."""
    group = least.spec.simulators[0]

    assert group.driver is Driver.STUB
    assert group.world.builtin == "arena"
    assert (group.image, group.command, group.options, group.env) == (None, (), (), ())


def test_simulators_are_expected_to_fail_sometimes(least) -> None:
    """By default a simulator may restart ten times in ten minutes, and has a minute to start.

    Without `recycle` in the spec, the plan decides when simulators are recycled.
    """
    group = least.spec.simulators[0]

    assert group.recycle is None
    assert (group.standby, group.min_simulators) == (False, None)
    assert (group.restart.limit, group.restart.within_seconds) == (10, 600)
    assert group.start_deadline_seconds == 60


def test_the_trainer_learns_to_move_to_the_target(least) -> None:
    """The default is the bundled task with an algorithm that solves it."""
    trainer = least.spec.trainer

    assert (trainer.environment.id, trainer.environment.reward) == ("MoveToTargetEnv-v0", "Dense")
    assert (trainer.algorithm.name, trainer.steps) == ("DQN", 50_000)
    assert (trainer.evaluation.every_steps, trainer.evaluation.episodes) == (2500, 20)
    assert (trainer.checkpoint.every_steps, trainer.checkpoint.keep) == (5000, 3)


def test_what_was_not_said_is_absent(least) -> None:
    """The models leave these fields None: the release or the cluster sets the value, or no limit applies."""
    spec = least.spec

    assert (spec.trainer.image, spec.trainer.evaluation.stop_at_success_rate) == (None, None)
    assert (spec.active_deadline_seconds, spec.ttl_seconds_after_finished) == (None, None)
    assert (spec.storage.storage_class_name, spec.storage.existing_claim) == (None, None)
    assert (spec.scheduling.queue_name, spec.managed_by) == (None, None)


def test_a_run_is_kept_and_tried_again(least) -> None:
    """By default the run directory outlives the job, and three failures are retried."""
    spec = least.spec

    assert (spec.storage.size, spec.storage.retain, spec.storage.ephemeral) == (
        "1Gi", "Keep", False,
    )  # fmt: skip
    assert (spec.backoff_limit, spec.stall_deadline_seconds, spec.suspend) == (3, 600, False)


def test_a_job_lies_in_the_namespace_default_and_has_no_uid(least) -> None:
    """Only an API server gives an object a uid."""
    assert (least.metadata.namespace, least.metadata.uid) == ("default", None)


def test_a_new_job_has_an_empty_status(least) -> None:
    """The operator writes the status, so a job that comes from a file has an empty one."""
    status = least.status

    assert (status.phase, status.observed_generation, status.start_time) == (None, None, None)
    assert (status.conditions, status.replicas) == ((), ())


def test_a_job_cannot_be_edited(least) -> None:
    """A plan is made from the job, so the job must not change afterwards."""
    with pytest.raises(ValidationError, match="frozen"):
        least.spec.replicas = 2


def test_names_in_python_are_written_in_snake_case() -> None:
    """YAML follows the naming of Kubernetes, and Python programs use the same models with Python's naming."""
    group = SimulatorGroup(name="collect", role=Role.COLLECT, start_deadline_seconds=5)

    assert group.model_dump(by_alias=True)["startDeadlineSeconds"] == 5


@pytest.mark.parametrize(("written", "read"), [(2, "2"), ("500m", "500m"), ("0.5", "0.5"), ("1Gi", "1Gi")])
def test_a_quantity_is_a_whole_number_or_a_text(written, read, job_data) -> None:
    """As in a pod, `cpu: 2` needs no quotes."""
    job = validate(job_data({"trainer.resources": {"limits": {"cpu": written}}}))

    assert job.spec.trainer.resources.limits == {"cpu": read}


def test_a_status_is_read_with_its_times_and_replicas(job_data) -> None:
    """A client can parse a status that the operator wrote."""
    seen = "2026-01-31T12:00:00Z"
    replica = {
        "index": 0,
        "phase": "Running",
        "attempt": 2,
        "step": 2500,
        "target": 50_000,
        "successRate": 0.4,
        "lastCheckpoint": {"step": 2000, "time": seen},
        "simulators": [{"name": "collect-0", "role": "Collect", "state": "ready", "restarts": 1}],
        "restarts": {"trainer": 1, "simulator": 1, "disruption": 0},
    }
    condition = {
        "type": "Running",
        "status": "True",
        "reason": "TrainersRun",
        "message": "1 of 1 replicas runs",
        "lastTransitionTime": seen,
    }
    status = {"phase": "Running", "startTime": seen, "conditions": [condition]}

    job = validate(job_data() | {"status": {**status, "replicas": [replica]}})

    assert job.status.start_time is not None
    assert job.status.start_time.year == 2026
    assert job.status.replicas[0].restarts.trainer == 1
    assert job.status.replicas[0].simulators[0].last_fault is None


@pytest.mark.parametrize("namespace", ["1team", "42", "team-1"])
def test_a_namespace_may_begin_with_a_digit(namespace, job_data) -> None:
    """RFC 1123 allows a digit at the beginning, so clusters have such namespaces."""
    data = job_data()
    data["metadata"]["namespace"] = namespace

    assert validate(data).metadata.namespace == namespace


def test_a_name_that_an_api_server_made_is_a_name(job_data) -> None:
    """`kubectl create` of a file with `generateName` produces such a name.

    The API server leaves `generateName` in the object.
    """
    data = job_data()
    data["metadata"] = {"name": "try-x2b4q", "generateName": "try-"}

    assert validate(data).metadata.name == "try-x2b4q"


def test_a_job_whose_name_is_still_to_be_made_is_refused_with_the_remedy(job_data) -> None:
    """`palaestra run` and `Client.apply` need the final name, to find the same job again later."""
    data = job_data({"replicas": 0})
    data["metadata"] = {"generateName": "try-"}

    with pytest.raises(SpecErrors) as refused:
        validate(data)

    assert refused.value.problems == (
        "metadata: has generateName and no name; add a name",
        "spec.replicas: 0 is less than 1; use 1 or more",
    )


def test_what_an_api_server_adds_to_the_metadata_is_passed_over(job_data) -> None:
    """A user can read a job from a cluster and use it as a job file."""
    data = job_data()
    data["metadata"] |= {"uid": "5a0c", "generation": 3, "managedFields": [], "finalizers": []}

    assert validate(data).metadata.uid == "5a0c"


NEWER_STATUS = {
    "phase": "Running",
    "ofTomorrow": {"deep": [1]},
    "release": {"trainer": "t:1", "stub": "s:1", "mujoco": "m:1", "webots": "w:1", "gazebo": "g:1"},
    "conditions": [
        {
            "type": type_,
            "status": status,
            "reason": "R",
            "message": "m",
            "lastTransitionTime": NOON,
            "by": "x",
        }
        for type_, status in (("Running", "True"), ("Halted", "True"), ("Failed", "Maybe"))
    ],
    "replicas": [
        {
            "index": 0,
            "phase": "Running",
            "restarts": {"trainer": 1, "operator": 2},
            "goodput": {"stepping": 4, "dreaming": 2},
            "simulators": [
                {"name": "collect-0", "role": "Collect", "state": "ready", "mood": "good"},
                {"name": "collect-1", "role": "Collect", "state": "dreaming"},
                {"name": "referee-0", "role": "Referee", "state": "ready"},
            ],
            "lastAttempt": {"attempt": 1, "reason": "R", "message": "m", "node": "n"},
        }
    ],
}


def test_what_a_newer_release_reports_besides_is_ignored(job_data) -> None:
    """After a rollback, an older operator or command line reads the fields that its release knows."""
    status = validate(job_data() | {"status": NEWER_STATUS}).status

    assert status.phase == "Running"
    assert [each.type for each in status.conditions] == ["Running"]
    (replica,) = status.replicas
    assert (replica.restarts.trainer, replica.last_attempt.attempt, replica.goodput.stepping) == (1, 1, 4)
    assert [each.name for each in replica.simulators] == ["collect-0"]


@pytest.mark.parametrize(
    "wrong",
    [{"phase": "Halted"}, {"replicas": [{"index": 0, "phase": "Halted"}]}, {"replicas": [{"index": "0"}]}],
)
def test_a_phase_or_type_that_is_unknown_is_still_refused(wrong, job_data) -> None:
    """An unknown phase could mean that a replica has ended.

    The operator must not start an ended replica again.
    """
    with pytest.raises(SpecErrors, match=r"^status"):
        validate(job_data() | {"status": wrong})


def test_an_unknown_field_of_the_spec_is_refused_as_ever(job_data) -> None:
    """People write the spec, so an unknown field there is a mistake."""
    with pytest.raises(SpecErrors, match=r"spec.ofTomorrow: is not a field"):
        validate(job_data({"ofTomorrow": 1}))
