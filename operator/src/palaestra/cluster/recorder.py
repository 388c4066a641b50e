"""Write events, which `kubectl describe` shows below an object.

One Event exists for each combination of object, reason and message. A repetition increases the Event's count
and sets its last time. The name of the Event is derived from these three values, so a restarted operator
increases the count of the existing Event. If an event cannot be written, the recorder logs the error and
drops the event, so that its caller does not wait. If the namespace is being deleted, the recorder raises an
exception instead, because otherwise the log would get a line for every event in that namespace.
"""

import hashlib
import threading
from collections import OrderedDict
from datetime import UTC, datetime
from typing import Any

import structlog

from palaestra.cluster.api import Api
from palaestra.cluster.errors import AlreadyExists, ApiError, NamespaceTerminating, NotFound
from palaestra.cluster.resources import EVENTS
from palaestra.objects import Object

log = structlog.get_logger("palaestra.cluster")

LONGEST_MESSAGE = 1024  # characters; events.k8s.io/v1 has the same limit, in bytes
LONGEST_NAME = 253
REMEMBERED = 2048
COMPONENT = "palaestra-operator"


class Recorder:
    """Writes events; several threads may use one recorder."""

    def __init__(self, api: Api, component: str = COMPONENT, instance: str = "") -> None:
        """Prepare the recorder, without a request.

        Args:
            api: the API server that stores the events.
            component: the name of the reporting program, as `kubectl describe` shows it.
            instance: the name of the reporting process.
        """
        self._api = api
        self._component = component
        self._instance = instance
        self._lock = threading.Lock()
        self._counts: OrderedDict[str, int] = OrderedDict()

    def record(self, obj: Object, kind: str, reason: str, message: str, *, once: bool = False) -> None:
        """Write an event about an object.

        Args:
            obj: the object, with apiVersion and kind, and with name, namespace and uid in its metadata.
            kind: `Normal` or `Warning`.
            reason: one word.
            message: a sentence; cut at 1024 characters.
            once: whether to leave the count unchanged if the event already exists.

        Raises:
            NamespaceTerminating: events about this object can no longer be written.
        """
        event = self._event(obj, kind, reason, message)
        try:
            self._write(event, once=once)
        except NamespaceTerminating:
            raise
        except ApiError as error:
            log.warning("event not written", reason=reason, name=event["metadata"]["name"], error=str(error))

    def _write(self, event: dict[str, Any], *, once: bool) -> None:
        namespace, name = event["metadata"]["namespace"], event["metadata"]["name"]
        with self._lock:
            count = self._counts.get(name)
        if once and count is not None:
            return
        try:
            if count is None:
                self._api.create(EVENTS, event)
                self._remember(name, 1)
            else:
                self._again(event, count + 1)
        except AlreadyExists:  # another process wrote the event, or this process has forgotten the count
            if once:
                self._remember(name, 1)
                return
            found = self._api.get(EVENTS, namespace, name)
            self._again(event, int(found.get("count") or 1) + 1)
        except NotFound:  # the API server has deleted the event, by default after an hour
            self._api.create(EVENTS, event)
            self._remember(name, 1)

    def _again(self, event: dict[str, Any], count: int) -> None:
        metadata = event["metadata"]
        patch = {"count": count, "lastTimestamp": event["lastTimestamp"]}
        self._api.merge(EVENTS, metadata["namespace"], metadata["name"], patch)
        self._remember(metadata["name"], count)

    def _remember(self, name: str, count: int) -> None:
        with self._lock:
            self._counts[name] = count
            self._counts.move_to_end(name)
            while len(self._counts) > REMEMBERED:
                self._counts.popitem(last=False)

    def _event(self, obj: Object, kind: str, reason: str, message: str) -> dict[str, Any]:
        metadata = obj["metadata"]
        name, uid = str(metadata["name"]), str(metadata.get("uid", ""))
        # Events about nodes are in the namespace `default`.
        namespace = str(metadata.get("namespace") or "default")
        text = message if len(message) <= LONGEST_MESSAGE else message[: LONGEST_MESSAGE - 1] + "…"
        digest = hashlib.sha256(f"{uid}\0{kind}\0{reason}\0{text}".encode()).hexdigest()[:16]
        now = datetime.now(UTC).strftime("%Y-%m-%dT%H:%M:%SZ")
        return {
            "apiVersion": EVENTS.api_version,
            "kind": EVENTS.kind,
            "metadata": {"name": f"{name[: LONGEST_NAME - 17]}.{digest}", "namespace": namespace},
            "involvedObject": {
                "apiVersion": obj["apiVersion"],
                "kind": obj["kind"],
                "namespace": str(metadata.get("namespace") or ""),
                "name": name,
                "uid": uid,
            },
            "type": kind,
            "reason": reason,
            "message": text,
            "source": {"component": self._component},
            "reportingComponent": self._component,
            "reportingInstance": self._instance,
            "firstTimestamp": now,
            "lastTimestamp": now,
            "count": 1,
        }
