"""A field of the TrainingJob as text for a terminal, in the format of `kubectl explain`."""

from collections.abc import Iterator
from textwrap import wrap

from palaestra.api.field_docs import FieldDoc, default_of, kind_of

_INDENT = "  "


def field_text(field: FieldDoc, width: int, *, recursive: bool = False) -> str:
    """Return the text about a field: type, default, description, rules, and the fields of its value.

    Args:
        field: the documentation of the field.
        width: the width of a line in characters; a long name or type may exceed it.
        recursive: whether to list the names and types of all fields below, without their descriptions.
    """
    lines = [f"{field.shown_path}: {_facts(field)}" if field.path else field.name, ""]
    for paragraph in field.paragraphs:
        lines += [*_wrapped(paragraph, width, 1), ""]
    if field.rules:
        lines += ["Rules:", *_rules(field, width), ""]
    if field.children:
        lines += ["Fields:", *(_tree(field, 1) if recursive else _described(field, width))]
    return "\n".join(lines).rstrip() + "\n"


def _facts(field: FieldDoc) -> str:
    """Return one line with the type, and with the default, `required` or `optional`."""
    default = default_of(field.schema)
    otherwise = f"default: {default}" if default else "optional"
    return f"{kind_of(field.schema)}; {'required' if field.required else otherwise}"


def _rules(field: FieldDoc, width: int) -> Iterator[str]:
    for rule in field.rules:
        yield from _wrapped(f"{rule.field}: {rule.message}" if rule.field else rule.message, width, 1)


def _tree(field: FieldDoc, depth: int) -> Iterator[str]:
    for child in field.children:
        yield f"{_INDENT * depth}{child.name}: {_facts(child)}"
        yield from _tree(child, depth + 1)


def _described(field: FieldDoc, width: int) -> Iterator[str]:
    for child in field.children:
        yield f"{_INDENT}{child.name}: {_facts(child)}"
        for paragraph in child.paragraphs[:1]:
            yield from _wrapped(paragraph, width, 2)


def _wrapped(text: str, width: int, depth: int) -> list[str]:
    return wrap(
        text,
        width,
        initial_indent=_INDENT * depth,
        subsequent_indent=_INDENT * depth,
        break_long_words=False,
        break_on_hyphens=False,
    )
