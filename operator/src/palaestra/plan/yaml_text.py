"""Objects as YAML for people: fields in their own order, long texts as blocks, no anchors.

Also text that the kubelet passes to a container unchanged.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any

import yaml

# YAML treats these as line ends and would read back other characters; in double quotes they are escaped.
_BREAKS = frozenset("\x85\u2028\u2029")
# PyYAML reads such values, for example 5e-4, as text, but kubectl reads them as numbers.
_NUMBER = re.compile(r"[-+]?[0-9.][0-9._]*([eE][-+]?[0-9]+)?")


class _Dumper(yaml.CSafeDumper):
    """PyYAML's safe dumper for people."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - equal parts are written in full
        """Return True, so that no anchors are written."""
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
    """Return the escaped form from which a kubelet makes `text`, for commands, arguments and variables.

    A kubelet replaces `$(NAME)` by the variable, and `$$` by `$`.
    """
    return text.replace("$", "$$")
