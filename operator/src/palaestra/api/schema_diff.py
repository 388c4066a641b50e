"""Compare the CustomResourceDefinition in a cluster with that of this release.

An API server drops status fields that its definition lacks, and refuses a status with an enum value that its
definition lacks. Additional fields of the served definition belong to a newer release and are ignored.
"""

from collections.abc import Iterator, Mapping
from typing import Any

Schema = Mapping[str, Any]


def lacks(served: Schema, ours: Schema, path: str = "") -> Iterator[str]:
    """Yield "<path>: <fact>" for each field of `ours` that is missing or different in `served`.

    Both are structural schemas. The fields below a missing field are not listed.
    """
    kind, wanted = served.get("type"), ours.get("type")
    if kind != wanted:
        yield f"{path}: is {_of_type(kind)}, not {_of_type(wanted)}"
        return
    if unknown := [choice for choice in ours.get("enum", ()) if choice not in served.get("enum", (choice,))]:
        yield f"{path}: lacks {', '.join(map(str, unknown))}"
    for name, inner in ours.get("properties", {}).items():
        below = f"{path}.{name}" if path else name
        if name in served.get("properties", {}):
            yield from lacks(served["properties"][name], inner, below)
        else:
            yield f"{below}: is missing"
    for keyword, mark in (("items", "[]"), ("additionalProperties", "{}")):
        if keyword in ours:
            yield from lacks(served.get(keyword, {}), ours[keyword], f"{path}{mark}")


def _of_type(kind: object) -> str:
    return "of no type" if kind is None else f"of type {kind}"
