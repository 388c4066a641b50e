"""The field tables of docs/reference/trainingjob.md, generated from the schema of the CRD."""

from collections.abc import Iterator

from palaestra.api.field_docs import FieldDoc, default_of, kind_of, whole_job
from palaestra.api.generated_sections import between_marks

BEGIN = "<!-- generated from the models: palaestra.api.reference -->"


def page(text: str) -> str:
    """Return the page docs/reference/trainingjob.md with new tables; `text` is the present page.

    Raises:
        ValueError: a mark is missing.
    """
    return between_marks(text, BEGIN, tables())


def tables() -> str:
    """Return a section for each object of a TrainingJob: a table of its fields, then its rules."""
    documented = (field for field in whole_job().walk() if field.path and field.children)
    return "\n".join(line for field in documented if field.path != ("metadata",) for line in _section(field))


def _section(field: FieldDoc) -> Iterator[str]:
    value = field.schema.get("items", field.schema)
    yield f"### {field.shown_path}{'[]' if 'items' in field.schema else ''}"
    yield ""
    yield value["description"].replace("\n", "\n\n")
    yield ""
    yield "| field | type | default | meaning |"
    yield "|---|---|---|---|"
    for child in field.children:
        meaning = _cell(child.schema["description"].split("\n")[0])
        kind = _cell(kind_of(child.schema, "`{}`".format))
        yield f"| `{child.name}` | {kind} | {_default(child)} | {meaning} |"
    yield ""
    yield from _rules(field)


def _rules(field: FieldDoc) -> Iterator[str]:
    if not field.rules:
        return
    yield "A job that breaks a rule is refused with one of these messages:"
    yield ""
    for rule in field.rules:
        yield f"- `{rule.field}`: {rule.message}" if rule.field else f"- {rule.message}"
    yield ""


def _default(field: FieldDoc) -> str:
    if field.required:
        return "*required*"
    text = default_of(field.schema)
    return "absent" if text is None else text and f"`{text}`"


def _cell(text: str) -> str:
    return text.replace("|", "\\|")
