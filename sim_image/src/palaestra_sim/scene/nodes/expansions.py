"""The PROTOs with templates, expanded for the values of their instances."""

from __future__ import annotations

from collections.abc import Mapping

from palaestra_sim.scene.nodes.scope import Scope
from palaestra_sim.world import Node, Proto, Value

MAX_BYTES = 64 * 1024 * 1024
"""Maximum size of all expanded files of a world together; each instance may need a separate file."""

Bindings = Mapping[str, tuple[Value, Scope]]


class Expansions:
    """Expands templates; instances with the same values share the result."""

    def __init__(self) -> None:
        self._found: dict[tuple[object, ...], Proto] = {}
        self._bytes = 0

    def of(self, proto: Proto, bindings: Bindings) -> Proto:
        """Return `proto` with the body that it has for these values of its fields.

        Raises:
            WorldError: the template cannot be expanded for these values, or the files become too large.
        """
        if proto.template is None:
            return proto
        whole = _resolved(bindings)
        values = {name: whole[name] for name in sorted(proto.template.fields & whole.keys())}
        key = (proto.name, *((name, _plain(value)) for name, value in values.items()))
        if key not in self._found:
            expanded = proto.with_values(values)
            self._bytes += len(expanded.source.data)
            if self._bytes > MAX_BYTES:
                fact = f"the templates of the world become more than {MAX_BYTES} bytes"
                raise proto.source.error(0, fact, "use fewer instances with different values")
            self._found[key] = expanded
        return self._found[key]


def _plain(value: Value) -> tuple[object, ...]:
    """Return the items of a value with their types, because 1 equals True; all nodes count as equal."""
    return tuple((type(item), None if isinstance(item, Node) else item) for item in value.items)


def _resolved(bindings: Bindings) -> dict[str, Value]:
    """Return the values of an instance; an `IS` has the value of the field of the surrounding PROTO."""
    found = {name: scope.value(value) for name, (value, scope) in bindings.items()}
    return {name: value[0] for name, value in found.items() if value is not None}
