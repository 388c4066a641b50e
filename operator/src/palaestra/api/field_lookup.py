"""Find a field by the path that a person types, or suggest the nearest fields."""

import difflib
import re
from collections.abc import Iterable

from pydantic.alias_generators import to_camel

from palaestra.api.field_docs import FieldDoc, whole_job
from palaestra.api.text import either, one_line
from palaestra.errors import PalaestraError

_MOST_NEAR = 3
_LONGEST_QUOTE = 120
# A path for `kubectl explain` begins with one of these names.
_KIND_NAMES = {"trainingjob", "trainingjobs", "tj"}
_INDEX = re.compile(r"\[[^\]]*\]")


class UnknownField(PalaestraError, LookupError):
    """A TrainingJob has no field with this path; the message suggests the nearest fields."""


def field_at(text: str) -> FieldDoc:
    """Return the field of a path such as `spec.trainer.steps`; `spec.` is optional, indices are ignored.

    An empty path is the whole TrainingJob.

    Raises:
        UnknownField: a TrainingJob has no field with this path.
    """
    names = [name for name in _INDEX.sub("", text).split(".") if name]
    if names and names[0].lower() in _KIND_NAMES:
        names = names[1:]
    job = whole_job()
    spec = _descend(job, ["spec"])[0]
    in_job, in_spec = _descend(job, names), _descend(spec, names)
    for found, rest in (in_job, in_spec):
        if not rest:
            return found
    deepest = in_job[0] if in_job[0].path else in_spec[0]
    typed = one_line(text, _LONGEST_QUOTE)
    raise UnknownField(f"{typed}: is not a field of a TrainingJob; {_remedy(deepest, names[-1])}")


def _descend(field: FieldDoc, names: list[str]) -> tuple[FieldDoc, list[str]]:
    """Return the last existing field along the path `names`, and the remaining names."""
    for count, name in enumerate(names):
        below = next((child for child in field.children if child.name == name), None)
        if below is None:
            return field, names[count:]
        field = below
    return field, []


def _remedy(deepest: FieldDoc, name: str) -> str:
    if not deepest.children:
        return f"{deepest.shown_path} has no fields of its own; see `palaestra explain {deepest.shown_path}`"
    if near := _nearest(deepest, to_camel(name.replace("-", "_"))):
        return f"did you mean {either(near)}?"
    return f"{deepest.shown_path} has {', '.join(child.name for child in deepest.children)}"


def _nearest(deepest: FieldDoc, name: str) -> list[str]:
    """Return the paths of the fields with the most similar names, first among the children of `deepest`."""
    for fields in (deepest.children, [*deepest.walk()][1:], [*whole_job().walk()][1:]):
        if matches := _matches(name, fields):
            found = [field.shown_path for match in matches for field in fields if field.name == match]
            return found[:_MOST_NEAR]
    return []


def _matches(name: str, fields: Iterable[FieldDoc]) -> list[str]:
    names = {field.name.lower(): field.name for field in fields}
    return [names[near] for near in difflib.get_close_matches(name.lower(), names, n=_MOST_NEAR, cutoff=0.7)]
