"""The field tables of docs/reference/trainingjob.md, generated from the schema of the CRD."""

import json
from collections.abc import Iterator
from typing import Any

from palaestra.api.crd import schema
from palaestra.api.generated_sections import between_marks
from palaestra.api.job import TrainingJob
from palaestra.api.model_walk import model_at
from palaestra.api.structural import Schema

BEGIN = "<!-- generated from the models: palaestra.api.reference -->"


def page(text: str) -> str:
    """Return the page docs/reference/trainingjob.md, now `text`, with its tables updated.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, tables())


def tables() -> str:
    """Return a section for each object of a TrainingJob: a table of its fields, then its rules."""
    return "\n".join(line for path, at in _objects(schema(), ()) for line in _section(path, at))


def _objects(at: Schema, path: tuple[str, ...]) -> Iterator[tuple[tuple[str, ...], Schema]]:
    """Yield every object below `at` that has fields, with its path."""
    if "items" in at:
        yield from _objects(at["items"], (*path[:-1], f"{path[-1]}[]"))
    elif path != ("metadata",):
        if path and "properties" in at:
            yield path, at
        for name, inner in at.get("properties", {}).items():
            yield from _objects(inner, (*path, name))


def _section(path: tuple[str, ...], at: Schema) -> Iterator[str]:
    yield f"### {'.'.join(path)}"
    yield ""
    yield at["description"].replace("\n", "\n\n")
    yield ""
    yield "| field | type | default | meaning |"
    yield "|---|---|---|---|"
    for name, field in at["properties"].items():
        meaning = field["description"].split("\n")[0].replace("|", "\\|")
        default = _default(field, required=name in at.get("required", ()))
        yield f"| `{name}` | {_kind(field)} | {default} | {meaning} |"
    yield ""
    yield from _rules(path)


def _rules(path: tuple[str, ...]) -> Iterator[str]:
    model = model_at(TrainingJob, tuple(piece.removesuffix("[]") for piece in path))
    if model is None or not (model.rules or model.guards):
        return
    yield "A job that breaks a rule is refused with one of these messages:"
    yield ""
    for rule in (*model.rules, *model.guards):
        yield f"- `{rule.field}`: {rule.message}" if rule.field else f"- {rule.message}"
    yield ""


def _default(field: Schema, *, required: bool) -> str:
    if required:
        return "*required*"
    if "default" not in field:
        return "absent"
    text = json.dumps(_without_nested_defaults(field["default"], field))
    return "" if text in {"{}", "[]"} else f"`{text}`"


def _without_nested_defaults(default: Any, field: Schema) -> Any:
    """Return `default` without values that equal the defaults of its fields, which other tables show."""
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


def _kind(field: Schema) -> str:
    if "enum" in field:
        return " \\| ".join(f"`{member}`" for member in field["enum"])
    if "items" in field:
        return f"list of {_kind(field['items'])}"
    if "additionalProperties" in field:
        return f"map to {_kind(field['additionalProperties'])}"
    if field.get("x-kubernetes-preserve-unknown-fields"):
        return "anything"
    kind = str(field.get("format", field.get("type", "quantity")))
    return _KINDS.get(kind, kind) + _range(field)


_KINDS = {
    "boolean": "true \\| false",
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
