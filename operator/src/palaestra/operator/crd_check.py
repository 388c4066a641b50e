"""Compare the cluster's CustomResourceDefinition with the fields that this release writes.

With `crds.install: false` an administrator applies the definition, and may forget to update it. Then the API
server drops new fields of a status without an error. The operator decides without these fields, but people
see an incomplete status. The API server also refuses a status with a condition of a new type. So the operator
leaves out such conditions until it has read that the definition allows them. Conditions that the stored
status already has stay.

Printer columns and selectable fields are not compared, because their absence loses no written value.

The operator has no permission to read CustomResourceDefinitions, so it reads the OpenAPI document, which
every account may read. If that read fails, the operator still works.
"""

import threading
from collections.abc import Callable, Iterator, Mapping
from typing import Any

import structlog

from palaestra.api.crd import schema
from palaestra.api.job import API_VERSION, KIND
from palaestra.api.status import ConditionType
from palaestra.cluster import Api, ApiError
from palaestra.observe.json_access import part, parts, text

READ_S = 5.0
FIRST_PAUSE_S = 10.0  # the API server publishes a definition some seconds after it was applied
MOST_SHOWN = 20
# An older definition does not allow these types of conditions.
_NEW = frozenset({ConditionType.RECONCILING.value, ConditionType.STALLED.value})

Schema = Mapping[str, Any]

log = structlog.get_logger(__name__)


class CrdCheck:
    """The CustomResourceDefinition in a cluster, compared with the definition of this release.

    Args:
        api: the cluster.
        changed: called when the cluster's definition starts to allow the new condition types.

    Attributes:
        outdated: whether the cluster's definition lacks fields; None: it was not read yet.
    """

    def __init__(self, api: Api, changed: Callable[[], None]) -> None:
        self._api = api.within(READ_S)
        self._changed = changed
        self._found: tuple[str, ...] = ()
        self._knows_new = False
        self.outdated: bool | None = None

    def follow(self, stopping: threading.Event, every_s: float) -> None:
        """Compare at once; then compare repeatedly in a separate thread until no field is missing."""
        self._try_look()
        threading.Thread(
            target=self._follow, args=(stopping, every_s), name="definition", daemon=True
        ).start()

    def look(self) -> None:
        """Compare once, and log the missing fields if they have changed."""
        try:
            served = self._api.schema(API_VERSION, KIND)
        except ApiError as error:
            log.info("CustomResourceDefinition not read", error=str(error))
            return
        before, self._found = self._found, tuple(_lacking(served.get("properties", {})))
        knew, self._knows_new = self._knows_new, _condition_types(served) >= _NEW
        self.outdated = bool(self._found)
        if self._knows_new and not knew:
            self._changed()
        if self._found and self._found != before:
            log.warning(
                "CustomResourceDefinition outdated",
                lacks=self._found[:MOST_SHOWN],
                count=len(self._found),
                remedy="kubectl apply --server-side --filename manifests/crd.yaml of this release",
            )

    def accepted(self, stored: Any, status: dict[str, Any]) -> dict[str, Any]:
        """Return a status without the conditions whose types the definition does not allow.

        Until the definition was read, a new type is allowed only if the `stored` status has a condition of
        this type.
        """
        if self._knows_new:
            return status
        there = {text(condition, "type") for condition in parts(stored, "conditions")}
        refused = _NEW if self.outdated else _NEW - there
        kept = [condition for condition in status["conditions"] if condition["type"] not in refused]
        return {**status, "conditions": kept}

    def _follow(self, stopping: threading.Event, every_s: float) -> None:
        pause_s = FIRST_PAUSE_S
        while self.outdated is not False and not stopping.wait(pause_s):
            self._try_look()
            pause_s = min(2 * pause_s, every_s)

    def _try_look(self) -> None:
        try:
            self.look()
        except Exception:  # an unexpected document must not end the operator
            log.exception("CustomResourceDefinition not compared")


def _lacking(served: Mapping[str, Any]) -> list[str]:
    ours = schema()["properties"]
    return [fact for part in ("spec", "status") for fact in lacks(served.get(part, {}), ours[part], part)]


def _condition_types(served: Mapping[str, Any]) -> frozenset[str]:
    """Return the types of conditions that a served schema allows."""
    way = ("status", "properties", "conditions", "items", "properties", "type")
    return frozenset(part(served, "properties", *way).get("enum", ()))


def lacks(served: Schema, ours: Schema, path: str = "") -> Iterator[str]:
    """Yield "<path>: <difference>" for each field of `ours` that `served` lacks or defines differently.

    `ours` and `served` are structural schemas. The fields below a missing field are not listed. Additional
    fields of `served` belong to a newer release and are ignored.
    """
    kind, wanted = served.get("type"), ours.get("type")
    if kind != wanted:
        yield f"{path}: is {_of_type(kind)}, not {_of_type(wanted)}"
        return
    if unknown := [choice for choice in ours.get("enum", ()) if choice not in served.get("enum", (choice,))]:
        yield f"{path}: lacks {', '.join(map(str, unknown))}"
    for name, inner in ours.get("properties", {}).items():
        below = f"{path}.{name}" if path else name
        if name in served.get("properties", {}):
            yield from lacks(served["properties"][name], inner, below)
        else:
            yield f"{below}: is missing"
    for keyword, mark in (("items", "[]"), ("additionalProperties", "{}")):
        if keyword in ours:
            yield from lacks(served.get(keyword, {}), ours[keyword], f"{path}{mark}")


def _of_type(kind: object) -> str:
    return "of no type" if kind is None else f"of type {kind}"
