"""Build HTML elements as text; every function escapes plain text."""

from __future__ import annotations

import html
import json
import re
from typing import Any

# These control characters and surrogates are not allowed in HTML or in UTF-8.
_REFUSED = re.compile(r"[\x00-\x08\x0b\x0c\x0e-\x1f\x7f-\x9f\ud800-\udfff\ufdd0-\ufdef\ufffe\uffff]")
_VOID = frozenset({"input", "meta"})


class Markup(str):
    """Text that is already HTML; only this module converts plain text to this type."""

    __slots__ = ()


def escaped(text: str) -> Markup:
    """Return text as HTML, for an element or for an attribute in double quotes."""
    return Markup(html.escape(_REFUSED.sub("\ufffd", text)))


def joined(*children: str) -> Markup:
    """Return texts and elements as one text; escape plain texts."""
    return Markup("".join(child if isinstance(child, Markup) else escaped(child) for child in children))


def element(name: str, /, *children: str, **attributes: str | float | None) -> Markup:
    """Return an element; its children are elements and plain texts, which are escaped.

    An attribute that is None is omitted. In the name of an attribute, `_` stands for `-`, and a last `_` is
    dropped, as in `class_`.
    """
    words = [name]
    for key, value in attributes.items():
        if value is not None:
            text = value if isinstance(value, str) else f"{value:.6g}"
            words.append(f'{key.rstrip("_").replace("_", "-")}="{escaped(text)}"')
    start = f"<{' '.join(words)}>"
    return Markup(start if name in _VOID else f"{start}{joined(*children)}</{name}>")


def json_script(content: Any, name: str = "data") -> Markup:
    """Return a script element of class `name` with JSON data for the page.

    The data cannot end the element.
    """
    text = json.dumps(content, separators=(",", ":"), allow_nan=False)  # the text contains only ASCII
    for character in "<>&":
        text = text.replace(character, f"\\u{ord(character):04x}")
    return Markup(f'<script type="application/json" class="{escaped(name)}">{text}</script>')


def own_code(name: str, text: str) -> Markup:
    """Return an element with a script or a style of this package, without escaping it.

    Raises:
        ValueError: the text could end the element.
    """
    if "</" in text:
        raise ValueError(f"a {name} of a report has the characters </, which would end it; write <\\/")
    return Markup(f"<{name}>{text}</{name}>")
