"""A JSON Schema (draft 7) of the TrainingJob for editors and programs, with the checks of the CRD's schema.

Language servers of YAML read draft 7. Language servers support neither Kubernetes' keywords nor its rules. So
the rules about several fields are only listed, under `x-palaestra-rules`.
"""

from collections.abc import Mapping
from typing import Any

from palaestra.api.field_docs import FieldDoc, FieldPath
from palaestra.api.job import API_VERSION, KIND
from palaestra.api.structural import Schema

DIALECT = "http://json-schema.org/draft-07/schema#"

# These keywords have the same meaning in the schema of the CRD and in JSON Schema.
_KEPT = (
    "description", "type", "pattern", "enum", "minimum", "maximum", "minLength", "maxLength", "minItems",
    "maxItems", "minProperties", "maxProperties", "default",
)  # fmt: skip

_FIXED: Mapping[FieldPath, str] = {("apiVersion",): API_VERSION, ("kind",): KIND}
_METADATA = ("metadata",)  # Kubernetes defines the other fields of metadata


def json_schema(field: FieldDoc) -> Schema:
    """Return the JSON Schema of a field's value, or of a whole TrainingJob."""
    return {"$schema": DIALECT, "title": field.shown_path or KIND, **_value(field)}


def _value(field: FieldDoc) -> Schema:
    result = _converted(field.schema)
    if fixed := _FIXED.get(field.path):
        result["const"] = fixed
    if field.children:
        at = result.get("items", result)
        at["properties"] = {child.name: _value(child) for child in field.children}
        at["additionalProperties"] = field.path == _METADATA
        if needed := [child.name for child in field.children if child.required]:
            at["required"] = needed
        if field.rules:
            at["x-palaestra-rules"] = [{"field": rule.field, "message": rule.message} for rule in field.rules]
    if field.path == ("status",):
        result["readOnly"] = True
    return result


def _converted(schema: Schema) -> Schema:
    """Return the schema of a value without the schemas of its fields."""
    result: dict[str, Any] = {key: schema[key] for key in _KEPT if key in schema}
    if schema.get("exclusiveMinimum"):
        result["exclusiveMinimum"] = result.pop("minimum")
    if schema.get("format") == "date-time":
        result["format"] = "date-time"
    if schema.get("x-kubernetes-int-or-string"):
        result["type"] = ["integer", "string"]
    if schema.get("nullable") and "type" in result:
        result["type"] = [result["type"], "null"]
    if "items" in schema:
        result["items"] = _converted(schema["items"])
    if "additionalProperties" in schema:
        result["additionalProperties"] = _converted(schema["additionalProperties"])
    return result
