"""The CustomResourceDefinition is structural, bounded and small, and agrees with the models."""

import re
from collections.abc import Iterator
from typing import Any

import pytest

from palaestra.api import TrainingJob, as_data, validate
from palaestra.api.crd import crd
from palaestra.api.generated_files import crd_text
from palaestra.api.model_walk import walk

FORBIDDEN = {
    "$ref", "$defs", "allOf", "anyOf", "oneOf", "not", "title", "const", "examples", "propertyNames",
    "prefixItems", "patternProperties", "definitions", "uniqueItems", "x-may-change",
}  # fmt: skip
FROZEN = "cannot be changed; make a new TrainingJob"
VERSION = crd()["spec"]["versions"][0]
WHOLE = VERSION["schema"]["openAPIV3Schema"]


def schemas(schema: dict[str, Any], path: str = "") -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield every schema below `schema`, each with its path."""
    yield path, schema
    for name, inner in schema.get("properties", {}).items():
        yield from schemas(inner, f"{path}.{name}".lstrip("."))
    if "items" in schema:
        yield from schemas(schema["items"], f"{path}[]")
    if "additionalProperties" in schema:
        yield from schemas(schema["additionalProperties"], f"{path}{{}}")


ALL = dict(schemas(WHOLE))


def rules_of(path: str) -> list[dict[str, str]]:
    """Return the CEL rules at `path`."""
    return ALL[path].get("x-kubernetes-validations", [])


def frozen(path: str) -> bool:
    """Return whether the field at `path` cannot change: a rule freezes it, its parent or all its children."""
    above, _, name = path.rpartition(".")
    if "" in kept(path) or {"", f".{name}"} & kept(above):
        return True
    parts = ALL[path].get("properties", {})
    return bool(parts) and all(frozen(f"{path}.{part}") for part in parts)


def kept(path: str) -> set[str]:
    """Return the paths that the rules at `path` freeze: fields of the object, or "" for the whole object."""
    return {rule.get("fieldPath", "") for rule in rules_of(path) if rule["message"] == FROZEN}


def test_no_keyword_is_used_that_a_structural_schema_forbids() -> None:
    """An API server refuses the whole definition if one of these keywords is in it."""
    assert [path for path, schema in ALL.items() if FORBIDDEN & schema.keys()] == []


def test_every_type_is_spelled_out() -> None:
    """An API server refuses an untyped value.

    Only quantities and free objects may have an `x-kubernetes-` mark instead.
    """
    marks = ("x-kubernetes-int-or-string", "x-kubernetes-preserve-unknown-fields")
    untyped = [path for path, schema in ALL.items() if "type" not in schema]

    assert untyped
    assert all(any(ALL[path].get(mark) is True for mark in marks) for path in untyped)


@pytest.mark.parametrize(
    ("kind", "bounds"),
    [
        ("string", {"maxLength", "enum", "format"}),
        ("array", {"maxItems"}),
        (None, {"maxLength", "x-kubernetes-preserve-unknown-fields"}),
    ],
)
def test_every_text_and_list_is_bounded(kind, bounds) -> None:
    """An API server refuses a CEL rule whose cost could be too high for the largest possible object."""
    unbounded = [
        path for path, schema in ALL.items()
        if schema.get("type") == kind and not bounds & schema.keys()
    ]  # fmt: skip

    assert unbounded == []


def test_every_map_is_bounded_and_every_object_has_fields() -> None:
    """Without fields or a limit on its keys, an object makes the estimated cost of CEL rules too high."""
    loose = [
        path for path, schema in ALL.items()
        if schema.get("type") == "object"
        and "properties" not in schema and "maxProperties" not in schema
    ]  # fmt: skip

    assert loose == []


def test_free_objects_keep_what_an_api_server_does_not_know() -> None:
    """Without `x-kubernetes-preserve-unknown-fields` the API server would prune all hyperparameters.

    The mark is on the values of a map: in an object with unknown fields, an API server would not notice that
    a frozen field has a renamed key.
    """
    free = [path for path, schema in ALL.items()
            if schema.get("x-kubernetes-preserve-unknown-fields")]  # fmt: skip

    assert free == [
        "spec.trainer.environment.options{}",
        "spec.trainer.environment.wrappers[].options{}",
        "spec.trainer.algorithm.hyperparameters{}",
        "spec.trainer.algorithm.callbacks[].options{}",
        "spec.scheduling.affinity{}",
    ]
    assert all(ALL[path]["nullable"] for path in free)


def test_every_field_is_described() -> None:
    """People read the descriptions with `kubectl explain`."""
    fields = [path for path in ALL if path.startswith(("spec", "status"))
              and not path.endswith(("]", "}"))]  # fmt: skip

    assert [path for path in fields if not ALL[path].get("description")] == []


def test_the_definition_is_small_enough_to_be_applied() -> None:
    """`kubectl apply` copies the definition into an annotation of at most 262,144 bytes.

    Half of that limit leaves space for new fields.
    """
    assert len(crd_text().encode()) < 131_072


def test_the_defaults_are_those_of_the_models(job_data) -> None:
    """A job must mean the same whether an API server or the models fill in its defaults."""

    def filled(schema: dict[str, Any], data: Any) -> Any:
        if "items" in schema:
            return [filled(schema["items"], item) for item in data]
        if not isinstance(data, dict):
            return data
        given = {
            name: inner["default"]
            for name, inner in schema.get("properties", {}).items()
            if "default" in inner
        } | data
        return {name: filled(schema.get("properties", {}).get(name, {}), value)
                for name, value in given.items()}  # fmt: skip

    data = filled(WHOLE, job_data())

    expected = as_data(validate(job_data()))
    assert data["spec"] == expected["spec"]


def test_rules_stand_where_the_models_have_them() -> None:
    """The API server must refuse the same jobs as the models, at the same path and with the same message."""
    for path, model in walk(TrainingJob):
        at = WHOLE
        for name in path:
            at = at["properties"][name]
            at = at.get("items", at)
        told = {rule["message"] for rule in at.get("x-kubernetes-validations", [])} - {FROZEN}
        assert told == {rule.message for rule in (*model.rules, *model.guards) if rule.cel}, path


def test_a_rule_names_a_field_that_the_object_has() -> None:
    """An API server refuses a definition whose rule names a missing field."""
    for path, schema in ALL.items():
        for rule in schema.get("x-kubernetes-validations", []):
            assert f"{path}{rule.get('fieldPath', '')}" in ALL


@pytest.mark.parametrize(
    "path",
    [
        "spec.suspend",
        "spec.activeDeadlineSeconds",
        "spec.stallDeadlineSeconds",
        "spec.ttlSecondsAfterFinished",
        "spec.simulators[].startDeadlineSeconds",
    ],
)
def test_deadlines_ttl_and_suspend_may_change(path) -> None:
    """These fields limit the duration of a run and do not change its result."""
    assert not frozen(path)


@pytest.mark.parametrize(
    "path",
    [
        *(
            f"spec.{name}"
            for name in ("replicas", "seed", "trainer", "storage", "backoffLimit", "scheduling",
                         "imagePullSecrets", "managedBy", "simulators")
        ),
        *(
            f"spec.simulators[].{name}"
            for name in ("name", "role", "count", "image", "driver", "command", "world", "recycle",
                         "minSimulators", "reset", "standby", "batch", "options", "restart", "env",
                         "resources")
        ),
    ],
)  # fmt: skip
def test_all_else_stays_as_it_was_accepted(path) -> None:
    """If a spec could change during a run, nobody could say which spec produced the result."""
    assert frozen(path)


def test_every_field_of_the_spec_is_either_frozen_or_may_change() -> None:
    """The author of a new field must decide whether users may change it."""
    free = [name for name in ALL["spec"]["properties"] if not frozen(f"spec.{name}")]

    assert free == [
        "suspend",
        "activeDeadlineSeconds",
        "stallDeadlineSeconds",
        "startTimeoutSeconds",
        "noProgressLimit",
        "ttlSecondsAfterFinished",
    ]


def test_a_field_of_a_part_is_kept_by_a_rule_of_its_own() -> None:
    """The API server's message has the path of the rule, so the rule must be at the frozen field.

    A rule at `spec.trainer` would not name the field that changed.
    """
    alone = ("spec.trainer.steps", "spec.trainer.algorithm.name", "spec.storage.size", "spec.network.egress")

    assert [path for path in alone if "" not in kept(path)] == []


def test_groups_cannot_be_added_or_removed() -> None:
    """A rule on an item applies only to an item that existed before, so the list needs a rule of its own."""
    assert rules_of("spec.simulators")[-1]["rule"] == (
        "size(self) == size(oldSelf) && self.all(item, oldSelf.exists(old, old.name == item.name))"
    )


def test_lists_of_named_things_are_maps_to_the_api_server() -> None:
    """The API server then refuses a duplicate name, and finds an item's old value by the item's name."""
    named = {path for path, schema in ALL.items() if schema.get("x-kubernetes-list-type") == "map"}

    assert named == {
        "spec.simulators",
        "spec.simulators[].env",
        "spec.trainer.env",
        "spec.imagePullSecrets",
        "status.conditions",
        "status.replicas",
    }


def test_the_keys_of_such_a_list_are_required() -> None:
    """An API server refuses the definition if a map key of a list is an optional field."""
    for schema in ALL.values():
        for key in schema.get("x-kubernetes-list-map-keys", []):
            assert key in schema["items"]["required"]


def test_of_the_metadata_only_the_name_is_bounded() -> None:
    """In the metadata, an API server accepts only rules on `name` and `generateName`.

    The limit on the name leaves space for the suffixes of the child objects.
    """
    assert ALL["metadata"]["properties"].keys() == {"name"}
    assert ALL["metadata.name"]["maxLength"] == 48


def test_columns_show_what_there_is() -> None:
    """A printer column whose path matches no field would stay empty for ever."""
    for column in VERSION["additionalPrinterColumns"]:
        path = re.sub(r"\[\?.*?\]", "[]", column["jsonPath"]).removeprefix(".")
        assert path in ALL or path == "metadata.creationTimestamp"


def test_a_field_to_select_by_is_a_plain_one() -> None:
    """An API server refuses the definition if a selectable field is a list or an object."""
    for field in VERSION["selectableFields"]:
        assert ALL[field["jsonPath"].removeprefix(".")]["type"] == "string"


def test_the_columns_of_every_day_say_where_a_job_stands_and_why() -> None:
    """`kubectl get` shows these columns.

    The others need `-o wide`, which people use only after they notice a problem.
    """
    columns = VERSION["additionalPrinterColumns"]

    assert [column["name"] for column in columns if not column.get("priority")] == [
        "Status", "Reason", "Replicas", "Step", "Target", "Success", "Age",
    ]  # fmt: skip


def test_status_is_written_apart_and_the_short_name_is_tj() -> None:
    """A user with permission to edit a job must not be able to write its status."""
    assert VERSION["subresources"] == {"status": {}}
    assert crd()["spec"]["names"]["shortNames"] == ["tj"]
    assert crd()["spec"]["names"]["categories"] == ["all", "palaestra"]
    assert crd()["metadata"]["name"] == "trainingjobs.palaestra.dev"
