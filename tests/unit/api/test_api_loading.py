"""`load` reports all mistakes of a job file at once, and each mistake only once."""

import pytest

from palaestra.api import load, validate
from palaestra.errors import PalaestraError, SpecErrors, TrainingJobError

FIVE_MISTAKES = """\
apiVersion: palaestra.dev/v1alpha1
kind: TrainingJob
metadata:
  name: Five_Mistakes
spec:
  replicas: "2"
  simulators:
    - {name: collect, role: Collect, world: {builtin: arena, file: /hall.wbt}}
    - {name: evaluate, role: Eval}
  trainer:
    stepps: 1000
"""


def told(text: str) -> tuple[str, ...]:
    """Return the problems that are reported for a wrong job file."""
    with pytest.raises(SpecErrors) as caught:
        load(text, "job.yaml")
    return caught.value.problems


def test_five_mistakes_are_five_lines() -> None:
    """Nobody wants to run a program five times to find five mistakes."""
    assert told(FIVE_MISTAKES) == (
        (
            'metadata.name: "Five_Mistakes" is not a name; '
            "use a-z first, then a-z, 0-9 and '-', no '-' at the end"
        ),
        'spec.replicas: "2" is text; write a whole number without quotes',
        'spec.simulators[1].role: "Eval" is not a role; use Collect or Evaluate',
        "spec.trainer.stepps: is not a field; did you mean steps?",
        (
            "spec.simulators[0].world: needs exactly one of inline, configMap, builtin and file; "
            "set one of them"
        ),
    )


def test_the_error_reads_as_its_lines() -> None:
    """A program that prints the error prints one line for each mistake."""
    error = SpecErrors("job.yaml", ("a: is wrong; mend it", "b: too; also"))

    assert str(error) == "a: is wrong; mend it\nb: too; also"
    assert isinstance(error, TrainingJobError)
    assert isinstance(error, PalaestraError)
    assert isinstance(error, ValueError)


def test_a_rule_is_not_judged_on_a_field_that_is_wrong(problems) -> None:
    """The group's role is invalid, so the rule about collectors cannot be checked."""
    assert problems({"simulators": [{"name": "a", "role": "collects"}]}) == [
        'spec.simulators[0].role: "collects" is not a role; use Collect or Evaluate'
    ]


def test_a_rule_is_judged_when_only_other_fields_are_wrong(problems) -> None:
    """The wrong deadline does not affect the rule about roles, so both mistakes are reported."""
    group = {"name": "a", "role": "Evaluate", "startDeadlineSeconds": 0}

    assert problems({"simulators": [group]}) == [
        "spec.simulators[0].startDeadlineSeconds: 0 is less than 1; use 1 or more",
        "spec.simulators: no group has role Collect; add one",
    ]


def test_a_rule_keeps_its_place_when_earlier_items_are_wrong(problems) -> None:
    """The message has the index of the item in the author's file."""
    groups = [
        "nonsense",
        {"name": "a", "role": "nonsense"},
        {"name": "b", "role": "Collect", "world": {}},
    ]

    assert problems({"simulators": groups})[-1].startswith("spec.simulators[2].world: needs")


def test_rules_of_the_spec_are_judged_under_a_wrong_name(job_data) -> None:
    """The rules of the spec do not depend on the metadata, so a wrong name does not hide their messages."""
    data = job_data({"suspend": True, "scheduling.queueName": "robots"})
    data["metadata"] = {"name": "-"}

    with pytest.raises(SpecErrors) as caught:
        validate(data)

    assert [line.split(":")[0] for line in caught.value.problems] == [
        "metadata.name",
        "spec.suspend",
    ]


def test_two_groups_of_one_name_are_found_beside_another_mistake(problems) -> None:
    """Only the second pass of the validation finds duplicate names.

    The error has the mistakes of both passes.
    """
    groups = [
        {"name": "a", "role": "Collect", "count": 0},
        {"name": "a", "role": "Evaluate"},
    ]

    assert problems({"simulators": groups}) == [
        "spec.simulators[0].count: 0 is less than 1; use 1 or more",
        'spec.simulators: "a" is the name of two entries; make the names unique',
    ]


def test_no_simulators_is_not_the_same_as_nothing_said(problems) -> None:
    """An empty list is a mistake, but a missing list means the default groups."""
    assert problems({"simulators": []}) == ["spec.simulators: has no entry; give one or remove the line"]


@pytest.mark.parametrize("key", ["apiVersion", "kind", "metadata", "spec"])
def test_what_every_object_needs_is_asked_for(key, job_data) -> None:
    """`kubectl` refuses a file without these keys, so `validate` refuses it too."""
    data = job_data()
    del data[key]

    with pytest.raises(SpecErrors, match=f"^{key}: is missing; add"):
        validate(data)


def test_an_object_of_another_kind_is_reported_only_as_such(job_data) -> None:
    """A TrainingJob lacks most fields of a Deployment.

    A message about each field would hide the wrong kind.
    """
    data = {**job_data(), "apiVersion": "apps/v1", "kind": "Deployment", "spec": {"template": {}}}

    with pytest.raises(SpecErrors) as caught:
        validate(data)

    assert caught.value.problems == (
        'apiVersion: "apps/v1" is not known; use palaestra.dev/v1alpha1',
        'kind: "Deployment" is not known; use TrainingJob',
    )


def test_a_wrong_version_alone_hides_nothing(job_data) -> None:
    """The author meant a TrainingJob, so its fields are checked too."""
    data = {**job_data({"replicas": 0}), "apiVersion": "palaestra.dev/v1"}

    with pytest.raises(SpecErrors) as caught:
        validate(data)

    assert caught.value.problems == (
        'apiVersion: "palaestra.dev/v1" is not known; use palaestra.dev/v1alpha1',
        "spec.replicas: 0 is less than 1; use 1 or more",
    )


@pytest.mark.parametrize(
    ("text", "fact"),
    [
        ("", "the document is empty"),
        ("# nothing\n", "the document is empty"),
        ("- a\n- b\n", "the document is a list, not a mapping"),
        ("just words", 'the document is "just words", not a mapping'),
    ],
)
def test_a_document_that_is_no_mapping_is_refused(text, fact) -> None:
    """Such a document has no fields, so the message begins with the name of the file."""
    assert told(text) == (f"job.yaml: {fact}; begin it with apiVersion: palaestra.dev/v1alpha1",)


def test_the_error_for_a_file_that_is_no_yaml_has_line_and_column() -> None:
    """Line and column are counted from 1, as in editors."""
    problem = told("spec:\n  trainer: [1, 2\n")[0]

    assert problem.startswith("job.yaml:3:1: not YAML: ")


def test_snake_case_is_refused_as_in_a_cluster() -> None:
    """A cluster refuses snake case, so a laptop must refuse it too."""
    text = FIVE_MISTAKES.replace("stepps: 1000", "evaluation: {every_steps: 100}")

    assert "spec.trainer.evaluation.every_steps: is not a field; did you mean everySteps?" in told(text)


MILLIONS = """\
apiVersion: palaestra.dev/v1alpha1
kind: TrainingJob
metadata: {name: millions}
spec:
  trainer:
    algorithm: {name: DQN, hyperparameters: {buffer_size: 1e6, learning_rate: 1e-4, gamma: 1.0}}
    steps: 1e6
    evaluation: {everySteps: 5.0e+4}
"""


def test_a_whole_number_is_one_however_it_is_written() -> None:
    """An API server stores `1e6` as an integer. A file must mean the same on a laptop and on a cluster."""
    trainer = load(MILLIONS).spec.trainer
    given = trainer.algorithm.hyperparameters

    assert (trainer.steps, trainer.evaluation.every_steps) == (1_000_000, 50_000)
    assert given == {"buffer_size": 1_000_000, "learning_rate": 1e-4, "gamma": 1}
    assert [type(value) for value in given.values()] == [int, float, int]


@pytest.mark.parametrize("steps", ["1.5", "1e-3", "1e300"])
def test_a_number_that_is_not_whole_is_still_refused(steps) -> None:
    """A job cannot train half a step. A float that is too large to be an exact integer is refused too."""
    assert any("spec.trainer.steps" in each for each in told(MILLIONS.replace("1e6\n", f"{steps}\n")))
