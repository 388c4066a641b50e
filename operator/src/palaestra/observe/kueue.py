"""Find the reason for which Kueue does not admit a Job, in the Job's Workloads."""

from collections.abc import Iterable, Iterator

from palaestra.observe.json_access import condition, holds, part, parts, text
from palaestra.observe.models import Raw

NO_WORKLOAD = (
    "Kueue has created no Workload; check that Kueue runs and manages this namespace, "
    "and that the PriorityClass exists"
)
_READY = "Ready"  # the state of an admission check that has passed


def why_not_admitted(workloads: Iterable[Raw]) -> str:
    """Return Kueue's reason not to admit a Job, on one line, from the Workloads that Kueue created for it.

    The reason is Kueue's own message where Kueue has one. The result is "" if Kueue has admitted the Job, or
    reports no reason yet.
    """
    newest = max(workloads, key=lambda raw: text(part(raw, "metadata"), "creationTimestamp"), default=None)
    if newest is None:
        return NO_WORKLOAD
    if part(newest, "spec").get("active") is False:
        name = text(part(newest, "metadata"), "name", 253)
        return f"Workload {name} is not active; set its spec.active to true"
    if not holds(newest, "QuotaReserved"):
        return text(condition(newest, "QuotaReserved"), "message")
    return "" if holds(newest, "Admitted") else "; ".join(_checks(newest))


def _checks(workload: Raw) -> Iterator[str]:
    """Yield the state and message of each admission check that has not passed."""
    for check in parts(workload, "status", "admissionChecks"):
        name, state = text(check, "name", 316), text(check, "state", 20)
        if state != _READY:
            words = text(check, "message")
            yield f"AdmissionCheck {name} is {state}" + (f": {words}" if words else "")
