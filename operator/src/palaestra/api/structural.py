"""Convert pydantic's JSON Schema into the structural schema that an API server requires.

A structural schema contains no references and no alternatives, and states the type and the limits of every
value. Descriptions are copied from the models.
"""

from typing import Any

from palaestra.api.fields import MAY_CHANGE

Schema = dict[str, Any]

FROZEN = "cannot be changed; make a new TrainingJob"

# These keywords have the same meaning in JSON Schema and in a structural schema, so they are copied.
_KEPT = (
    "description", "type", "format", "pattern", "enum", "minimum", "maximum", "required",
    "minLength", "maxLength", "minItems", "maxItems", "minProperties", "maxProperties",
    "nullable", "x-kubernetes-int-or-string", "x-kubernetes-preserve-unknown-fields",
    "x-kubernetes-list-type", "x-kubernetes-list-map-keys", "x-kubernetes-validations",
    MAY_CHANGE,
)  # fmt: skip
_OPAQUE = "x-kubernetes-preserve-unknown-fields"
_BOUNDS_OF = {"array": "Items", "object": "Properties"}


def structural(schema: Schema, definitions: dict[str, Schema]) -> Schema:
    """Return `schema` with its references to `definitions` resolved, in structural form."""
    source = _whole(schema, definitions)
    result = {key: source[key] for key in _KEPT if key in source}
    if "description" in result:
        result["description"] = _unwrapped(result["description"])
    if "const" in source:
        result["enum"] = [source["const"]]
    if "exclusiveMinimum" in source:
        result |= {"minimum": source["exclusiveMinimum"], "exclusiveMinimum": True}
    if source.get("type") == "integer":
        result["format"] = "int64"
    _name_bounds(result)
    if "items" in source:
        result["items"] = structural(source["items"], definitions)
    if "properties" in source:
        result["properties"] = {
            name: structural(inner, definitions) for name, inner in source["properties"].items()
        }
    if isinstance(source.get("additionalProperties"), dict):
        result["additionalProperties"] = structural(source["additionalProperties"], definitions)
    if source.get("default") is not None:
        result["default"] = _present(source["default"])
    return result


def _whole(schema: Schema, definitions: dict[str, Schema]) -> Schema:
    """Return `schema` with its `$ref` replaced by the definition, and without the alternative null."""
    here = {key: value for key, value in schema.items() if key not in {"$ref", "anyOf"}}
    if "anyOf" in schema:
        (choice,) = (choice for choice in schema["anyOf"] if choice != {"type": "null"})
        return _whole(choice | here, definitions)
    if "$ref" not in schema:
        return here
    there = definitions[schema["$ref"].removeprefix("#/$defs/")]
    both = there | here
    if there.get("type") == "object" and "description" in here:
        # The first paragraph would repeat the field's description.
        _, *more = there["description"].split("\n\n")
        both["description"] = "\n\n".join((here["description"], *more))
    return both


def _unwrapped(text: str) -> str:
    """Return `text` with one line for each paragraph."""
    return "\n".join(" ".join(paragraph.split()) for paragraph in text.split("\n\n"))


def _name_bounds(schema: Schema) -> None:
    """Rename the limits of lists and maps to the keywords for their type."""
    kind = _BOUNDS_OF.get(schema.get("type", ""))
    for bound in ("min", "max"):
        if kind and f"{bound}Length" in schema:
            schema[f"{bound}{kind}"] = schema.pop(f"{bound}Length")


def _present(default: Any) -> Any:
    """Return `default` without null values, since the API server checks it with the schema's rules."""
    if isinstance(default, list):
        return [_present(item) for item in default]
    if isinstance(default, dict):
        return {name: _present(value) for name, value in default.items() if value is not None}
    return default


def freeze(schema: Schema) -> None:
    """Add rules to the object `schema` that refuse a change of any field without the mark `MAY_CHANGE`."""
    # An API server refuses a rule on a field with arbitrary content, so the field's parent gets the rule.
    whole = False
    for name, inner in schema["properties"].items():
        if inner.get(MAY_CHANGE):
            continue
        always = "default" in inner or name in schema.get("required", ())
        if _has_changeable_field(inner):
            _freeze_items(inner)
        elif always and "properties" in inner:
            freeze(inner)  # then the message of a refusal names the changed field, not its parent
        elif _OPAQUE in inner.get("additionalProperties", ()):
            whole = True
        elif always:
            _add(inner, {"rule": "self == oldSelf", "message": FROZEN})
        else:
            rule = (
                f"has(self.{name}) == has(oldSelf.{name})"
                f" && (!has(self.{name}) || self.{name} == oldSelf.{name})"
            )
            _add(schema, {"rule": rule, "message": FROZEN, "fieldPath": f".{name}"})
    if whole:
        _add(schema, {"rule": "self == oldSelf", "message": FROZEN})


def _freeze_items(inner: Schema) -> None:
    freeze(inner["items"])  # the API server matches old and new items by name
    same_names = "size(self) == size(oldSelf) && self.all(item, oldSelf.exists(old, old.name == item.name))"
    _add(inner, {"rule": same_names, "message": FROZEN})


def _add(schema: Schema, rule: dict[str, str]) -> None:
    schema["x-kubernetes-validations"] = [*schema.get("x-kubernetes-validations", ()), rule]


def _has_changeable_field(schema: Schema) -> bool:
    below = [*schema.get("properties", {}).values(), schema.get("items")]
    return any(inner.get(MAY_CHANGE) or _has_changeable_field(inner) for inner in below if inner)


def without_marks(schema: Any) -> Any:
    """Return `schema` without the marks `MAY_CHANGE`, which only `freeze` reads."""
    if isinstance(schema, list):
        return [without_marks(item) for item in schema]
    if not isinstance(schema, dict):
        return schema
    return {key: without_marks(value) for key, value in schema.items() if key != MAY_CHANGE}
