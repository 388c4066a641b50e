"""`palaestra explain` finds a field by the path that a person types; the JSON Schema has the same facts."""

import json

import jsonschema
import pytest
import yaml

from palaestra.api.field_docs import default_of, kind_of, whole_job
from palaestra.api.field_lookup import UnknownField, field_at
from palaestra.api.json_schema import json_schema
from palaestra.view.field_text import field_text

FIELDS = list(whole_job().walk())


@pytest.mark.parametrize(
    ("typed", "path"),
    [
        ("", ""),
        ("spec", "spec"),
        ("trainer.algorithm", "spec.trainer.algorithm"),
        ("spec.trainer.algorithm.name", "spec.trainer.algorithm.name"),
        ("simulators.role", "spec.simulators[].role"),
        ("simulators[0].world.builtin", "spec.simulators[].world.builtin"),
        ("TrainingJob.spec.seed", "spec.seed"),
        ("tj.status.phase", "status.phase"),
    ],
)
def test_a_field_is_found_as_kubectl_a_message_or_a_person_writes_it(typed, path) -> None:
    """Messages contain indices, `kubectl explain` puts the kind first, and people leave out `spec.`."""
    assert field_at(typed).shown_path == path


@pytest.mark.parametrize("field", FIELDS, ids=lambda field: field.shown_path or "TrainingJob")
def test_every_field_is_found_by_its_own_path_and_has_a_description(field) -> None:
    """A user can type every path that `--recursive` lists, and reads a description there."""
    assert field_at(field.shown_path) == field
    assert field.paragraphs


@pytest.mark.parametrize(
    ("typed", "remedy"),
    [
        ("trainer.algoritm", "did you mean spec.trainer.algorithm?"),
        ("trainer.frame_stack", "did you mean spec.trainer.environment.frameStack?"),
        (
            "everySteps",
            "did you mean spec.trainer.evaluation.everySteps or spec.trainer.checkpoint.everySteps?",
        ),
        (
            "storage.qqq",
            "spec.storage has size, storageClassName, retain, ephemeral, existingClaim, resumeFrom",
        ),
        (
            "trainer.algorithm.name.x",
            (
                "spec.trainer.algorithm.name has no fields of its own; "
                "see `palaestra explain spec.trainer.algorithm.name`"
            ),
        ),
    ],
)
def test_a_wrong_path_is_one_sentence_with_the_nearest_fields(typed, remedy) -> None:
    """People often remember a field's name without its path, or in Python's spelling."""
    with pytest.raises(UnknownField) as refused:
        field_at(typed)

    assert str(refused.value) == f"{typed}: is not a field of a TrainingJob; {remedy}"


def test_the_text_has_type_default_rules_and_fields() -> None:
    """A user who knows the tables of the reference page must find the same facts in the terminal."""
    text = field_text(field_at("trainer.algorithm.normalize"), 100)

    assert text.startswith("spec.trainer.algorithm.normalize: object; optional\n\n  Normalization of ")
    assert "Rules:\n  has no effect while observations and rewards are both false; remove it\n" in text
    assert "\n  observations: true | false; default: true\n    Whether each number of an " in text
    assert "\n  clipRewards: number, above 0 to 1,000,000; optional\n" in text


def test_the_recursive_text_has_every_field_once_and_no_description() -> None:
    """The text is short, so that a user can search it on the screen."""
    text = field_text(whole_job(), 100, recursive=True)

    named = [line.split(":")[0].strip() for line in text.partition("Fields:\n")[2].splitlines()]
    assert named == [field.name for field in FIELDS[1:]]


def test_no_line_of_prose_is_wider_than_the_terminal() -> None:
    """A terminal would break a wider line in the middle of a word."""
    lines = [line for field in FIELDS for line in field_text(field, 60).splitlines()]

    assert [line for line in lines if len(line) > 60 and ": " not in line and "://" not in line] == []


@pytest.fixture(scope="module")
def schema():
    """Return the JSON Schema of a TrainingJob, as `palaestra explain --json` prints it."""
    return json.loads(json.dumps(json_schema(whole_job())))


def test_the_json_schema_accepts_every_example(schema, repository) -> None:
    """If an editor marks a correct job as wrong, people switch its checks off."""
    jsonschema.Draft7Validator.check_schema(schema)

    for path in (repository / "manifests/examples").glob("*.yaml"):
        jsonschema.validate(yaml.safe_load(path.read_text(encoding="utf-8")), schema)


@pytest.mark.parametrize(
    ("change", "where"),
    [
        ({"trainer.steps": 0}, "spec.trainer.steps"),
        ({"trainer.step": 10}, "spec.trainer"),
        ({"simulators.1.role": "Eval"}, "spec.simulators.1.role"),
        ({"trainer.evaluation.stopAtSuccessRate": 0}, "spec.trainer.evaluation.stopAtSuccessRate"),
        ({"trainer.algorithm.name": "SARSA"}, "spec.trainer.algorithm.name"),
        ({"trainer.resources.limits": {"cpu": True}}, "spec.trainer.resources.limits.cpu"),
    ],
)
def test_the_json_schema_marks_a_mistake_at_its_field(schema, job_data, change, where) -> None:
    """An editor then shows the mistake before `palaestra` reads the file."""
    [error] = jsonschema.Draft7Validator(schema).iter_errors(job_data(change))

    assert ".".join(map(str, error.absolute_path)) == where


def test_the_json_schema_has_the_text_of_every_field(schema) -> None:
    """While a person types, an editor shows the description and offers the default and the fields."""
    algorithm = schema["properties"]["spec"]["properties"]["trainer"]["properties"]["algorithm"]
    field = field_at("trainer.algorithm")

    assert algorithm["description"] == field.paragraphs[0]
    assert algorithm["properties"]["name"]["default"] == json.loads(default_of(field.children[0].schema))
    assert json_schema(field)["properties"] == algorithm["properties"]
    assert [
        rule["field"] for rule in schema["properties"]["spec"]["properties"]["storage"]["x-palaestra-rules"]
    ].count("resumeFrom") == 1
    assert kind_of(field_at("simulators.driver").schema) == "stub | mujoco | webots | command"
