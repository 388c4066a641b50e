"""The fields of training.yaml, and the messages about mistakes in it."""

from __future__ import annotations

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from structlog.testing import capture_logs

from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import dump, load, load_run, parse

COMPLETE = """
job: move-to-target
namespace: default
uid: 6f1d
replica: 1
seed: 8
environment: {id: MoveToTargetEnv-v0, reward: Sparse, options: {max_steps: 50}}
algorithm: {name: PPO, hyperparameters: {learning_rate: 0.001}}
steps: 50000
evaluation: {everySteps: 2500, episodes: 20, stopAtSuccessRate: 0.95}
checkpoint: {everySteps: 5000, keep: 3}
stallDeadlineSeconds: 600
command: [python, mine.py]
statusAddress: 127.0.0.1:9090
simulators:
- name: collect-0
  group: collect
  index: 0
  role: Collect
  control: http://127.0.0.1:7100
  world: /w/collect-0.wbt
  minSimulators: 1
  recycle: {afterResets: 24, afterMinutes: 90, aboveMemoryBytes: 419430400}
  standby: true
  restart: {limit: 10, withinSeconds: 600}
  startDeadlineSeconds: 60
"""
MINIMAL = {
    "job": "m",
    "environment": {"id": "Any-v0"},
    "steps": 10,
    "simulators": [{"name": "c-0", "group": "c", "index": 0, "role": "Collect"}],
}


def test_every_field_of_the_contract_is_read(tmp_path):
    """The operator writes these fields, so the trainer must read each of them."""
    path = tmp_path / "training.yaml"
    path.write_text(COMPLETE)

    configuration = load(path)

    assert configuration.simulators[0].recycle.after_resets == 24
    assert configuration.simulators[0].standby
    assert configuration.evaluation.stop_at_success_rate == 0.95
    assert configuration.command == ("python", "mine.py")


def test_what_is_dumped_is_read_back_as_the_same():
    """The run directory has the dumped file, with which the run is evaluated later."""
    configuration = parse(yaml.safe_load(COMPLETE))

    assert parse(yaml.safe_load(dump(configuration))) == configuration


def test_all_mistakes_are_reported_at_once():
    """A person would need a new pod for each mistake if they were reported one by one."""
    wrong = MINIMAL | {"steps": 0, "evaluation": {"episodes": 0}, "seed": -1}

    with pytest.raises(ConfigurationError) as caught:
        parse(wrong)

    assert sorted(str(caught.value).splitlines()) == [
        "training.yaml: evaluation.episodes: 0 is refused; Input should be greater than or equal to 1",
        "training.yaml: seed: -1 is refused; Input should be greater than or equal to 0",
        "training.yaml: steps: 0 is refused; Input should be greater than or equal to 1",
    ]


def test_a_mistake_in_a_list_names_its_place():
    """A job may have thirty simulators, so the message has the index."""
    wrong = MINIMAL | {"simulators": [MINIMAL["simulators"][0] | {"role": "Colect"}]}

    with pytest.raises(ConfigurationError, match=r"simulators\[0\].role: 'Colect' is refused"):
        parse(wrong)


def test_an_unknown_field_is_logged_with_its_place_and_ignored():
    """The operator may be newer than the trainer's image.

    The run continues without the field.
    """
    newer = MINIMAL | {"simulators": [MINIMAL["simulators"][0] | {"roll": 1}], "ofTomorrow": {"a": [1]}}

    with capture_logs() as logs:
        read = parse(newer)

    assert read == parse(MINIMAL)
    assert [each["field"] for each in logs] == ["simulators[0].roll", "ofTomorrow"]
    assert logs[0]["hint"] == "did you mean role?"


def test_an_unknown_field_hides_no_mistake_of_another():
    """The check of several fields together must run, even if another field is unknown."""
    with pytest.raises(ConfigurationError, match="none has role Collect"):
        parse(MINIMAL | {"ofTomorrow": 1, "simulators": [MINIMAL["simulators"][0] | {"role": "Evaluate"}]})


@pytest.mark.parametrize(
    ("simulators", "fact"),
    [
        ([], "simulators"),
        ([MINIMAL["simulators"][0]] * 2, "c-0 is used twice"),
        ([MINIMAL["simulators"][0] | {"role": "Evaluate"}], "none has role Collect"),
    ],
)
def test_simulators_that_do_not_fit_together_are_refused(simulators, fact):
    """Each simulator is valid on its own, but not together with the others."""
    with pytest.raises(ConfigurationError, match=fact):
        parse(MINIMAL | {"simulators": simulators})


COPIES = MINIMAL["simulators"][0] | {"driver": "mujoco", "batch": 4}
OTHER = {"name": "e-0", "group": "e", "index": 0, "role": "Evaluate"}


@pytest.mark.parametrize(
    ("simulators", "changes", "fact"),
    [
        ([COPIES, OTHER | {"driver": "mujoco", "batch": 2}], {}, "batch is for one simulator with role Coll"),
        ([COPIES | {"role": "Evaluate"}], {}, "batch is for one simulator with role Collect"),
        ([COPIES, OTHER | {"role": "Collect"}], {}, "batch needs one collecting simulator; use a larger"),
        ([COPIES | {"driver": "stub"}], {}, "batch needs driver mujoco, without standby, reset and recycle"),
        ([COPIES | {"standby": True}], {}, "batch needs driver mujoco, without standby, reset and recycle"),
        ([COPIES], {"command": ["python", "mine.py"]}, "batch is for the built-in training loop"),
        ([COPIES], {"collection": "Asynchronous"}, "Asynchronous is for several simulators"),
    ],
)
def test_copies_of_a_world_that_do_not_fit_the_job_are_refused(simulators, changes, fact):
    """The operator refuses the same jobs, but a person may also write the file for a run on a laptop."""
    with pytest.raises(ConfigurationError, match=fact):
        parse(MINIMAL | changes | {"simulators": simulators})


def test_copies_of_a_world_are_accepted_with_a_simulator_that_evaluates():
    """The evaluation plays over ROS, as the policy of the job will later."""
    configuration = parse(MINIMAL | {"simulators": [COPIES, OTHER]})

    assert [simulator.batch for simulator in configuration.simulators] == [4, None]


def test_the_error_for_a_missing_file_has_the_variable_that_names_it(tmp_path, monkeypatch):
    """A person who started the program by hand has only this message."""
    monkeypatch.setenv("PALAESTRA_CONFIG", str(tmp_path / "none.yaml"))

    with pytest.raises(ConfigurationError, match=r"none.yaml: cannot be read .* PALAESTRA_CONFIG"):
        load()


def test_a_folder_that_is_not_a_run_directory_is_named(tmp_path):
    """For an evaluation or a comparison, a person types a folder and sets no variable."""
    with pytest.raises(ConfigurationError, match=r"has no training.yaml; give a run directory") as caught:
        load_run(tmp_path)

    assert str(caught.value).startswith(f"{tmp_path}: ")


def test_without_the_variable_the_remedy_names_it(monkeypatch):
    """On a laptop, the variable is usually not set."""
    monkeypatch.delenv("PALAESTRA_CONFIG", raising=False)

    with pytest.raises(ConfigurationError, match="PALAESTRA_CONFIG: is not set"):
        load()


def test_a_file_that_is_not_yaml_is_refused(tmp_path):
    """The message of the YAML parser has the position of the mistake."""
    path = tmp_path / "training.yaml"
    path.write_text("job: [")

    with pytest.raises(ConfigurationError, match="is not YAML"):
        load(path)


@given(
    st.recursive(
        st.none() | st.integers() | st.text(), lambda it: st.lists(it) | st.dictionaries(st.text(), it)
    )
)
def test_whatever_the_document_is_only_configuration_errors_come_out(content):
    """A traceback would not help the author of the file."""
    with pytest.raises(ConfigurationError):
        parse(content)
