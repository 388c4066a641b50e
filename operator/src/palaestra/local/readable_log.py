"""Convert the trainer's log for a person: show warnings and errors as sentences, and the user's own output.

`logs/trainer.log` has all lines unchanged, and `palaestra run --verbose` shows all lines.
"""

import ast
import re
from collections.abc import Iterator

_LINE = re.compile(r"^\d{4}-\d\d-\d\dT[\d:.]+Z \[(?P<level>\w+) *\] (?P<message>.*)$")
_FIELD = re.compile(r" (?P<name>[a-z_]\w*)=(?P<value>'(?:[^'\\]|\\.)*'|\"(?:[^\"\\]|\\.)*\"|\S+)")
_UNSHOWN = frozenset({"debug", "info"})


def readable(line: str) -> str | None:
    """Return the text to show for a line of the trainer's output.

    A warning or an error becomes its message, the fields that are sentences, and the other fields in
    parentheses. Output of the user's code is unchanged. The result is None for lines that are not shown,
    because the progress line has their values.
    """
    found = _LINE.match(line)
    if found is None:
        return line
    if found["level"] in _UNSHOWN:
        return None
    return f"{found['level']}: {_sentence(found['message'])}"


def _sentence(message: str) -> str:
    fields = list(_fields(message))
    first = _FIELD.search(message)
    event = message[: first.start()] if first else message
    texts = [value for _, value in fields if " " in value]
    values = [f"{name} {value}" for name, value in fields if " " not in value]
    return ": ".join([event, *texts]) + (f" ({', '.join(values)})" if values else "")


def _fields(message: str) -> Iterator[tuple[str, str]]:
    for found in _FIELD.finditer(message):
        yield found["name"], _text(found["value"])


def _text(value: str) -> str:
    """Return a logged value without its quotes."""
    if value[0] not in "'\"":
        return value
    try:
        return str(ast.literal_eval(value))
    except (SyntaxError, ValueError):  # the user's code may log anything
        return value
