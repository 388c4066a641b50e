"""The trainer reads the training.yaml that the plan writes; the packages share no code for it."""

from pathlib import Path

import pytest
import yaml
from structlog.testing import capture_logs

from palaestra.api import load
from palaestra.plan import ClusterLayout, Images, identified, plan
from palaestra_trainer.job.configuration import Normalize, parse
from palaestra_trainer.job.simulator_configuration import Recycle

EXAMPLES = sorted((Path(__file__).parents[3] / "manifests" / "examples").glob("*.yaml"))

COLLECT, EVALUATE = {"name": "collect", "role": "Collect"}, {"name": "evaluate", "role": "Evaluate"}
LAYOUT = ClusterLayout(images=Images.of_release("1"))


def read_back(job):
    """Return the trainer's reading of the training.yaml of a job's first replica.

    The trainer must log no unknown field.
    """
    planned = plan(identified(job, "uid"), LAYOUT).replicas[0]
    with capture_logs() as logs:
        read = parse(yaml.safe_load(planned.config_map["data"]["training.yaml"]))
    assert logs == []
    return read


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_the_training_yaml_of_every_example_is_read_by_the_trainer(example):
    """If one side renamed a field, only a run in a cluster would fail, minutes later."""
    job = load(example.read_text())

    read = read_back(job)

    assert read.steps == job.spec.trainer.steps
    assert [each.name for each in read.simulators] == [
        f"{group.name}-{i}" for group in job.spec.simulators for i in range(group.count)
    ]
    assert read.algorithm.hyperparameters == job.spec.trainer.algorithm.hyperparameters


def test_no_evaluation_is_written_as_zero_and_read_as_zero(valid_job):
    """If the section were absent, the trainer would evaluate at its own default interval."""
    job = valid_job(trainer={"evaluation": {"everySteps": 0}})

    read = read_back(job)

    assert read.evaluation.every_steps == 0


def test_wrappers_and_stacked_frames_are_read_as_they_were_written(valid_job):
    """Without its wrappers a policy would train in another environment than the job describes."""
    wrapper = {"name": "a.b:Own", "options": {"size": 2}}
    job = valid_job(trainer={"environment": {"wrappers": [wrapper], "frameStack": 3}})

    read = read_back(job).environment

    assert [each.model_dump() for each in read.wrappers or ()] == [wrapper]
    assert read.frame_stack == 3


@pytest.mark.parametrize(
    ("written", "read"),
    [
        ({}, None),
        ({"normalize": {}}, Normalize()),
        (
            {"normalize": {"rewards": False, "clipObservations": 5}},
            Normalize(rewards=False, clip_observations=5.0),
        ),
    ],
)
def test_what_is_normalized_is_read_as_it_was_written(valid_job, written, read):
    """The plan leaves absent fields to the trainer, which alone has the defaults."""
    job = valid_job(trainer={"algorithm": {"name": "PPO"} | written})

    assert read_back(job).algorithm.normalize == read


def test_an_initial_policy_is_read_as_it_was_written_and_absent_unless_set(valid_job):
    """A trainer of an older release logs each unknown field, so the plan leaves an unset field out."""
    initial = {"initialPolicy": {"claim": "policies", "path": "a/model.zip"}}

    assert read_back(valid_job(trainer=initial)).initial_policy == "/initial-policy/a/model.zip"
    assert read_back(valid_job()).initial_policy is None


@pytest.mark.parametrize("cnn", ["small", None])
def test_the_network_for_images_is_read_as_it_was_written(valid_job, cnn):
    """The trainer must build the network that the job describes.

    If the job does not set `cnn`, the plan leaves the field out.
    """
    job = valid_job(trainer={"algorithm": {"name": "PPO"} | ({"cnn": cnn} if cnn else {})})

    assert read_back(job).algorithm.cnn == cnn


@pytest.mark.parametrize("callbacks", [None, [{"name": "mine:Bored", "options": {"patience": 3}}]])
def test_callbacks_are_read_as_they_were_written(valid_job, callbacks):
    """The options of a callback are free-form.

    Their keys stay as written, unlike the fields of a TrainingJob.
    """
    job = valid_job(trainer={"algorithm": {"name": "PPO"} | ({"callbacks": callbacks} if callbacks else {})})

    read = read_back(job).algorithm.callbacks

    assert (None if read is None else [each.model_dump() for each in read]) == callbacks


def test_how_simulators_are_kept_going_is_read_as_it_was_written(valid_job):
    """The plan writes memory in bytes, because the trainer compares it with a number from the kernel."""
    group = {
        "name": "collect",
        "role": "Collect",
        "count": 2,
        "minSimulators": 1,
        "standby": True,
        "recycle": {"afterResets": 24, "afterMinutes": 90, "aboveMemory": "400Mi"},
    }

    collect, *_, evaluate = read_back(valid_job(simulators=[group, EVALUATE])).simulators

    assert (collect.min_simulators, collect.standby) == (1, True)
    assert collect.recycle == Recycle(after_resets=24, after_minutes=90, above_memory_bytes=400 * 2**20)
    assert (evaluate.min_simulators, evaluate.standby) == (1, False)
    assert evaluate.recycle is None


@pytest.mark.parametrize(
    ("group", "read"),
    [
        ({}, None),
        ({"driver": "mujoco"}, None),
        ({"driver": "webots", "image": "webots:1"}, Recycle(after_resets=24)),
        ({"driver": "command", "image": "own:1", "command": ["own"]}, Recycle(after_resets=24)),
        ({"recycle": {"afterResets": 24}}, Recycle(after_resets=24)),
    ],
    ids=["stub", "mujoco", "webots", "command", "stored job"],
)
def test_simulators_that_do_not_age_are_recycled_only_if_the_job_says_so(valid_job, group, read):
    """Needless restarts took a fifth of a training's time.

    Only the simulator of the original paper, Webots, failed at its 25th reset.
    """
    job = valid_job(simulators=[COLLECT | group, EVALUATE])

    assert read_back(job).simulators[0].recycle == read


def test_a_simulator_that_is_never_recycled_has_no_limit(valid_job):
    """`afterResets: 0` means never, in the job and in the file."""
    read = read_back(valid_job(simulators=[COLLECT | {"recycle": {"afterResets": 0}}, EVALUATE]))

    assert read.simulators[0].recycle is None


@pytest.mark.parametrize(
    ("resources", "device"),
    [
        ({}, "cpu"),
        ({"limits": {"cpu": 4, "memory": "8Gi"}}, "cpu"),
        ({"limits": {"nvidia.com/gpu": 1}}, "cuda"),
        ({"requests": {"amd.com/gpu": "2"}}, "cuda"),
        ({"limits": {"nvidia.com/gpu": 0}}, "cpu"),
        ({"limits": {"nvidia.com/gpu-memory": 1, "gpu.example.com/card": 1}}, "cpu"),
    ],
)
def test_a_gpu_that_the_trainer_asks_for_is_what_it_trains_on(valid_job, resources, device):
    """Without the device the GPU would be reserved and paid for, but idle."""
    assert read_back(valid_job(trainer={"resources": resources})).device == device


def test_the_file_of_a_job_without_a_gpu_says_nothing_of_devices(valid_job):
    """The ConfigMap is named after its content, so a new field in every file would change every name."""
    planned = plan(identified(valid_job(), "uid"), LAYOUT).replicas[0]

    assert "device" not in yaml.safe_load(planned.config_map["data"]["training.yaml"])


@pytest.mark.parametrize(
    ("written", "recycle", "reset"),
    [
        ({}, None, None),
        ({"reset": "Reset"}, None, None),
        ({"reset": "Reload"}, None, "Reload"),
        ({"reset": "Restart"}, Recycle(after_resets=1), None),
        (
            {"reset": "Restart", "recycle": {"afterMinutes": 30}},
            Recycle(after_resets=1, after_minutes=30),
            None,
        ),
    ],
)
def test_the_kind_of_reset_is_read_as_it_was_written(valid_job, written, recycle, reset):
    """The plan writes a restart as recycling after each reset, and a reload as the kind of reset.

    A plain reset is the default, so the plan writes nothing for it.
    """
    collecting = read_back(valid_job(simulators=[COLLECT | written, EVALUATE])).simulators[0]

    assert (collecting.recycle, collecting.reset) == (recycle, reset)
