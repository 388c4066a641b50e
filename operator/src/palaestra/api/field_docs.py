"""The documentation of a TrainingJob's fields, for the reference page, `palaestra explain` and editors.

All facts come from the schema of the CRD and from the rules of the models, so no text is written twice.
"""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

from palaestra.api.crd import schema
from palaestra.api.job import TrainingJob
from palaestra.api.model import Rule
from palaestra.api.model_walk import fields_of, model_at
from palaestra.api.structural import Schema

# The path of a field: the names of the fields from the TrainingJob down to this field. The name of a list
# ends in `[]` if a field of the list's items follows.
FieldPath = tuple[str, ...]
Quote = Callable[[str], str]


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldDoc:
    """The documentation of one field, or of the whole TrainingJob, whose path is empty.

    Attributes:
        path: the names of the fields from the TrainingJob to this field; the last is the name of this field.
        schema: the structural schema of the field's value.
        required: whether the parent must have this field.
        children: the fields of the value; for a list, the fields of each item.
    """

    path: FieldPath
    schema: Schema
    required: bool
    children: "tuple[FieldDoc, ...]"

    @property
    def name(self) -> str:
        """Return the last name of the path."""
        return self.path[-1] if self.path else "TrainingJob"

    @property
    def shown_path(self) -> str:
        """Return the path as text, such as `spec.simulators[].role`."""
        return ".".join(self.path)

    @property
    def paragraphs(self) -> list[str]:
        """Return the paragraphs of the description; for a list, append the paragraphs about its items."""
        own = self.schema.get("description", "").split("\n")
        items = self.schema.get("items", {}).get("description", "").split("\n")
        return [paragraph for paragraph in dict.fromkeys((*own, *items)) if paragraph]

    @property
    def rules(self) -> tuple[Rule, ...]:
        """Return the rules about several fields of the value; for a list, the rules of each item."""
        model = model_at(TrainingJob, tuple(piece.removesuffix("[]") for piece in self.path))
        return () if model is None else (*model.rules, *model.guards)

    def walk(self) -> "Iterator[FieldDoc]":
        """Yield this field and every field below it, parents first."""
        yield self
        for child in self.children:
            yield from child.walk()


@cache
def whole_job() -> FieldDoc:
    """Return the documentation of the TrainingJob with all its fields."""
    job = schema()
    for name, field in fields_of(TrainingJob).items():  # the CRD has no descriptions of the standard fields
        job["properties"][name].setdefault("description", " ".join((field.description or "").split()))
    job["properties"]["metadata"]["required"] = ["name"]
    return _doc((), job | {"required": [*job["required"], "apiVersion", "kind"]}, required=True)


def _doc(path: FieldPath, at: Schema, *, required: bool) -> FieldDoc:
    inner, above = at, path
    if "properties" in at.get("items", {}):
        inner, above = at["items"], (*path[:-1], f"{path[-1]}[]")
    children = tuple(
        _doc((*above, name), field, required=name in inner.get("required", ()))
        for name, field in inner.get("properties", {}).items()
    )
    return FieldDoc(path=path, schema=at, required=required, children=children)


def kind_of(field: Schema, quote: Quote = str) -> str:
    """Return the type and range of a field's values, such as `integer, 1 to 16`.

    `quote` formats each value of an enum.
    """
    if "enum" in field:
        return " | ".join(quote(member) for member in field["enum"])
    if "items" in field:
        return f"list of {kind_of(field['items'], quote)}"
    if "additionalProperties" in field:
        return f"map to {kind_of(field['additionalProperties'], quote)}"
    if field.get("x-kubernetes-preserve-unknown-fields"):
        return "anything"
    kind = str(field.get("format", field.get("type", "quantity")))
    return _KINDS.get(kind, kind) + _range(field)


def default_of(field: Schema) -> str | None:
    """Return a field's default as JSON; None without a default, "" if only inner fields have defaults."""
    if "default" not in field:
        return None
    text = json.dumps(_without_nested_defaults(field["default"], field))
    return "" if text in {"{}", "[]"} else text


def _without_nested_defaults(default: Any, field: Schema) -> Any:
    """Return `default` without the defaults of inner fields; the documentation of those fields has them."""
    if isinstance(default, list):
        return [_without_nested_defaults(item, field["items"]) for item in default]
    if not isinstance(default, dict):
        return default
    inner = field.get("properties", {})
    return {
        name: _without_nested_defaults(value, inner[name])
        for name, value in default.items()
        if name in inner and value != inner[name].get("default")
    }


_KINDS = {
    "boolean": "true | false",
    "date-time": "time",
    "int64": "integer",
    "string": "text",
}


def _range(field: Schema) -> str:
    low, high = field.get("minimum"), field.get("maximum")
    if low is None:
        return ""
    above = "above " if field.get("exclusiveMinimum") else ""
    return f", {above}{low:,} to {high:,}" if high is not None else f", {above}{low:,} or more"
