"""What a served definition of TrainingJobs lacks of this release's own.

An API server drops a field of a status that its definition does not have, and refuses a status with a
word that it does not know. Fields that a served definition has besides are of a newer release and are
not looked at.
"""

from collections.abc import Iterator, Mapping
from typing import Any

Schema = Mapping[str, Any]


def lacks(served: Schema, ours: Schema, path: str = "") -> Iterator[str]:
    """Yield, for each field that `served` does not have as `ours` does, its path and the fact.

    Both are structural schemas. A field that is missing is named, not the fields below it.
    """
    kind, wanted = served.get("type"), ours.get("type")
    if kind != wanted:
        yield f"{path}: is {_article(kind)}, not {_article(wanted)}"
        return
    if unknown := [choice for choice in ours.get("enum", ()) if choice not in served.get("enum", (choice,))]:
        yield f"{path}: does not know {', '.join(map(str, unknown))}"
    for name, inner in ours.get("properties", {}).items():
        below = f"{path}.{name}" if path else name
        if name in served.get("properties", {}):
            yield from lacks(served["properties"][name], inner, below)
        else:
            yield f"{below}: is missing"
    for keyword, mark in (("items", "[]"), ("additionalProperties", "{}")):
        if keyword in ours:
            yield from lacks(served.get(keyword, {}), ours[keyword], f"{path}{mark}")


def _article(kind: object) -> str:
    return "of no type" if kind is None else f"of type {kind}"
