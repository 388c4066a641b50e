"""Read and write one YAML document as Kubernetes clients do.

PyYAML differs from kubectl: PyYAML reads `5e-4` as text, `1:30` as the number 90 and a date as an object, and
silently accepts a duplicate key. With this module, a file has the same meaning on a laptop and in a cluster.
If the meaning of a value would differ, `read` raises an error with its line and column.
"""

import math
import re
from typing import Any

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

_BOOL = "tag:yaml.org,2002:bool"
_FLOAT = "tag:yaml.org,2002:float"
_INT = "tag:yaml.org,2002:int"
_MERGE = "tag:yaml.org,2002:merge"
_NULL = "tag:yaml.org,2002:null"
_TEXT = "tag:yaml.org,2002:str"

_TAGS = {_BOOL, _FLOAT, _INT, _NULL, _TEXT, "tag:yaml.org,2002:map", "tag:yaml.org,2002:seq"}

_MOST_NODES = 50_000  # the nodes of an alias count again each time the alias is used
_LARGEST_FILE = 1_500_000  # characters; an API server has the same limit for a request


class NotYaml(ValueError):
    """The text cannot be read; `problem` is one line with the position, the fact and the remedy."""

    def __init__(self, problem: str) -> None:
        super().__init__(problem)
        self.problem = problem


class _Loader(yaml.SafeLoader):
    """PyYAML's safe loader, which recognizes scalars by the rules of kubectl."""

    yaml_implicit_resolvers: dict[str, list[tuple[str, re.Pattern[str]]]] = {}  # noqa: RUF012 - PyYAML's name and shape


class _Dumper(yaml.SafeDumper):
    """PyYAML's safe dumper, which quotes text that PyYAML or kubectl would read as another type."""


def _represent_text(dumper: _Dumper, text: str) -> ScalarNode:
    """Return the node of `text`; quote it if it contains line breaks that YAML would fold."""
    style = '"' if re.search("[\x85\u2028\u2029\r]", text) else None
    return dumper.represent_scalar(_TEXT, text, style)


_Dumper.add_representer(str, _represent_text)

_SCALARS = {
    _BOOL: "yes|Yes|YES|no|No|NO|true|True|TRUE|false|False|FALSE|on|On|ON|off|Off|OFF",
    _INT: "[-+]?(0|[1-9][0-9_]*|0[0-7_]+|0x[0-9a-fA-F_]+|0b[01_]+)",
    _FLOAT: "[-+]?(([0-9]+[.]?[0-9]*|[.][0-9]+)([eE][-+]?[0-9]+)?|[.](inf|Inf|INF))|[.](nan|NaN|NAN)",
    _MERGE: "<<",
    _NULL: "~|null|Null|NULL|",
}
for _tag, _pattern in _SCALARS.items():
    for _class in (_Loader, _Dumper):
        _class.add_implicit_resolver(_tag, re.compile(f"^({_pattern})$"), None)


def write(data: Any) -> str:
    """Return `data` as YAML in the same order; `read` returns equal data."""
    return yaml.dump(data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=100)


def read(text: str, name: str) -> Any:
    """Return the single document in `text` as dicts, lists, texts, numbers, booleans and None.

    Raises:
        NotYaml: the text is not valid; its `problem` is "<name>:<line>:<column>: <fact>; <remedy>".
    """
    if len(text) > _LARGEST_FILE:
        raise NotYaml(f"{name}: is longer than {_LARGEST_FILE} characters; shorten it")
    try:
        loader = _Loader(text)
        try:
            node = loader.get_single_node()
            return None if node is None else _Builder(name, loader).value(node)
        finally:
            loader.dispose()
    except RecursionError:
        raise NotYaml(f"{name}: is nested too deeply, or contains itself; flatten it") from None
    except yaml.MarkedYAMLError as error:
        raise NotYaml(_describe(error, name)) from error
    except yaml.reader.ReaderError as error:
        place = _place_of(text, error.position, name)
        raise NotYaml(f"{place}: YAML does not allow this character; remove it") from error


def _describe(error: yaml.MarkedYAMLError, name: str) -> str:
    mark = error.problem_mark or error.context_mark
    place = f"{name}:{mark.line + 1}:{mark.column + 1}" if mark else name
    if error.problem == "but found another document":
        return f"{place}: a second document begins here; put one TrainingJob in a file"
    fact = error.problem or error.context or "not readable"
    return f"{place}: not YAML: {fact}; correct the line or quote the text"


def _place_of(text: str, position: int, name: str) -> str:
    before = text[:position]
    return f"{name}:{before.count(chr(10)) + 1}:{position - (before.rfind(chr(10)) + 1) + 1}"


class _Builder:
    """Converts nodes into data, and refuses values that JSON cannot represent."""

    def __init__(self, name: str, loader: _Loader) -> None:
        self._name = name
        self._loader = loader
        self._left = _MOST_NODES

    def value(self, node: Node) -> Any:
        """Return the data of `node` and of the nodes below it."""
        self._left -= 1
        if self._left < 0:
            raise self._refused(node, "more than 50000 values; shorten the file")
        if node.tag not in _TAGS:
            raise self._refused(node, f"the tag {node.tag} is not allowed in job files; remove it")
        if isinstance(node, MappingNode):
            return self._mapping(node)
        if isinstance(node, SequenceNode):
            return [self.value(item) for item in node.value]
        return self._scalar(node)

    def _mapping(self, node: MappingNode) -> dict[str, Any]:
        own: dict[str, Any] = {}
        merged: dict[str, Any] = {}
        for key_node, value_node in node.value:
            if key_node.tag == _MERGE:
                merged |= self._merged(value_node)
                continue
            key = self._key(key_node)
            if key in own:
                raise self._refused(key_node, f"duplicate key {key}; keep one")
            own[key] = self.value(value_node)
        return merged | own

    def _merged(self, node: Node) -> dict[str, Any]:
        """Return the entries that `<<` merges; if several mappings have one key, the first mapping wins."""
        value = self.value(node)
        sources = value if isinstance(value, list) else [value]
        if not all(isinstance(source, dict) for source in sources):
            raise self._refused(node, "<< needs a mapping; refer to one with *")
        return {key: item for source in reversed(sources) for key, item in source.items()}

    def _key(self, node: Node) -> str:
        if isinstance(node, ScalarNode) and node.tag == _TEXT:
            return str(node.value)
        if not isinstance(node, ScalarNode):
            raise self._refused(node, "a key is a list or a mapping; use text as the key")
        raise self._refused(node, f'the key {node.value} is not text; quote it: "{node.value}"')

    def _scalar(self, node: Node) -> Any:
        try:
            value = self._loader.construct_object(node)
        except (ValueError, KeyError):
            raise self._refused(
                node, "the value does not match its tag, or is too large; correct it"
            ) from None
        if isinstance(value, float) and not math.isfinite(value):
            raise self._refused(node, f"{node.value} is not a finite number; use a finite one")
        return value

    def _refused(self, node: Node, problem: str) -> NotYaml:
        mark = node.start_mark
        return NotYaml(f"{self._name}:{mark.line + 1}:{mark.column + 1}: {problem}")
