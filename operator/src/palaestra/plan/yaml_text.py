"""Objects as YAML that a person reads: fields in their own order, long texts as blocks, no anchors.

And text that comes through to a container as it stands.
"""

import re
from collections.abc import Iterable, Mapping
from typing import Any

import yaml

# Line ends to YAML, which would be read back as others; quoted doubly they are escaped.
_BREAKS = frozenset("\x85\u2028\u2029")
# Text to PyYAML, a number to kubectl: 5e-4.
_NUMBER = re.compile(r"[-+]?[0-9.][0-9._]*([eE][-+]?[0-9]+)?")


class _Dumper(yaml.CSafeDumper):
    """PyYAML's safe dumper for people."""

    def ignore_aliases(self, data: Any) -> bool:  # noqa: ARG002 - equal parts are written out
        """Return True: no object refers to a part of another."""
        return True


def _text(dumper: yaml.CSafeDumper, text: str) -> yaml.ScalarNode:
    return dumper.represent_scalar("tag:yaml.org,2002:str", text, style=_style(text))


def _style(text: str) -> str | None:
    if not _BREAKS.isdisjoint(text):
        return '"'
    return "|" if "\n" in text else "'" if _NUMBER.fullmatch(text) else None


_Dumper.add_representer(str, _text)


def as_yaml(documents: Iterable[Mapping[str, Any]]) -> str:
    """Return objects as YAML documents, as `kubectl apply` takes them."""
    return yaml.dump_all(documents, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=110)


def literal(text: str) -> str:
    """Return what a kubelet makes `text` of, in a command, its arguments and the values of variables.

    A kubelet puts variables in the place of `$(NAME)`, and takes two $ for one.
    """
    return text.replace("$", "$$")
