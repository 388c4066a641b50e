"""Write objects as YAML for people: fields keep their order, long texts are blocks, and no anchors occur.

`literal` escapes text so that the kubelet passes it to a container unchanged.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any

import yaml

# YAML treats these characters as line ends, so a reader would get other characters. PyYAML escapes the
# characters in a text in double quotes.
_BREAKS = frozenset("\x85\u2028\u2029")
# PyYAML reads a value such as 5e-4 as text, but kubectl reads it as a number. So such texts are quoted.
_NUMBER = re.compile(r"[-+]?[0-9.][0-9._]*([eE][-+]?[0-9]+)?")


class _Dumper(yaml.CSafeDumper):
    """PyYAML's safe dumper, but without anchors."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - repeated values are written in full
        """Return True, so that PyYAML writes no anchors."""
        return True


def _text(dumper: yaml.CSafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=_style(text))


def _style(text: str) -> str | None:
    if not _BREAKS.isdisjoint(text):
        return '"'
    return "|" if "\n" in text else "'" if _NUMBER.fullmatch(text) else None


_Dumper.add_representer(str, _text)


def as_yaml(documents: Iterable[Mapping[str, Any]]) -> str:
    """Return objects as YAML documents for `kubectl apply`."""
    return yaml.dump_all(documents, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=110)


def literal(text: str) -> str:
    """Return `text` escaped for a kubelet, for use in commands, arguments and variables.

    A kubelet replaces `$(NAME)` by the variable, and `$$` by `$`.
    """
    return text.replace("$", "$$")
