"""Evaluate the state and the events of a simulator's pod, for the program that waits for the pod; pure."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from palaestra_trainer.webots.launching.kubernetes_objects import Object

# The kubelet tries again after these failures. But a retry cannot help, because the cause is a mistake in the
# pod's specification or in the image's name.
_HOPELESS = frozenset(
    {
        "CreateContainerConfigError",
        "ErrImageNeverPull",
        "ImagePullBackOff",
        "InvalidImageName",
    }
)
_NOT_CREATED = "FailedCreate"
_MOST_EVENTS = 3


def address_of(pod: Object | None) -> str | None:
    """Return the IP address of a pod whose containers run; None for any other pod."""
    status = (pod or {}).get("status", {})
    running = [each for each in status.get("containerStatuses", ()) if "running" in each.get("state", {})]
    return status.get("podIP") if running else None


def failure_of(pod: Object | None, events: Iterable[Object]) -> str | None:
    """Return the reason why the pod cannot run; return None while the pod may still start.

    Args:
        pod: the pod; None if it does not exist yet.
        events: the events of the Job; only needed without a pod.
    """
    if pod is None:
        refused = (event["message"] for event in events if event.get("reason") == _NOT_CREATED)
        return next(refused, None)
    for container in _containers(pod):
        state = container.get("state", {})
        waiting, ended = state.get("waiting", {}), state.get("terminated")
        if waiting.get("reason") in _HOPELESS:
            return f"container {container['name']}: {waiting['reason']}: {waiting.get('message', '')}"
        if ended is not None:
            return _ended(container["name"], ended)
    status = pod.get("status", {})
    if status.get("phase") == "Failed":
        return f"{status.get('reason', 'the pod failed')}: {status.get('message', '')}"
    return None


def told(events: Iterable[Object]) -> str:
    """Return the newest warnings among events as text; "no events" without any."""
    warnings = [event for event in events if event.get("type") == "Warning"]
    lines = [f"{event.get('reason')}: {event.get('message')}" for event in sorted(warnings, key=_at)]
    return "; ".join(dict.fromkeys(lines[-_MOST_EVENTS:])) or "no events"


def _containers(pod: Object) -> Sequence[Object]:
    status = pod.get("status", {})
    return [*status.get("initContainerStatuses", ()), *status.get("containerStatuses", ())]


def _ended(name: str, ended: Object) -> str:
    said = str(ended.get("message", "")).strip()
    return said or f"container {name} ended with code {ended.get('exitCode')}"


def _at(event: Object) -> str:
    return str(event.get("lastTimestamp") or event.get("eventTime") or "")
