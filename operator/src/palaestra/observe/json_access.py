"""Read untrusted JSON: a value of a wrong type counts as absent, and a value that is too large is cut."""

from collections.abc import Iterator
from datetime import UTC, datetime
from typing import Any

from palaestra.api.text import one_line

MOST_TEXT = 600
MOST_ITEMS = 128  # limit of any list; a planned pod has at most 34 init containers
MOST_COUNT = 2_000_000_000  # the maximum of a count in a status


def part(raw: Any, *path: str) -> dict[str, Any]:
    """Return the object at `path` below `raw`, or an empty object."""
    for name in path:
        raw = raw.get(name) if isinstance(raw, dict) else None
    return raw if isinstance(raw, dict) else {}


def parts(raw: Any, *path: str) -> Iterator[dict[str, Any]]:
    """Yield the objects in the list at `path` below `raw`, at most 128."""
    *above, last = path
    items = part(raw, *above).get(last)
    if isinstance(items, list):
        yield from (item for item in items[:MOST_ITEMS] if isinstance(item, dict))


def text(raw: Any, name: str, most: int = MOST_TEXT) -> str:
    """Return the text of a field on one line, cut to `most` characters; "" if the field has no text."""
    value = raw.get(name) if isinstance(raw, dict) else None
    return one_line(value, most) if isinstance(value, str) else ""


def count(raw: Any, name: str) -> int:
    """Return the whole number in a field, limited to 0 to 2·10⁹; 0 if the field has no whole number."""
    value = raw.get(name) if isinstance(raw, dict) else None
    if not isinstance(value, int) or isinstance(value, bool):
        return 0
    return min(max(value, 0), MOST_COUNT)


def time(raw: Any, name: str) -> datetime | None:
    """Return the time in a field in UTC; None if the field has no valid time."""
    value = raw.get(name) if isinstance(raw, dict) else None
    return as_time(value) if isinstance(value, str) else None


def as_time(value: str) -> datetime | None:
    """Return the time in an RFC 3339 text, in UTC and whole seconds; None for any other text."""
    try:
        read = datetime.fromisoformat(value)
        at = read.astimezone(UTC) if read.tzinfo else read.replace(tzinfo=UTC)
    except (ValueError, OverflowError):
        return None
    return at.replace(microsecond=0)


def owners(raw: Any) -> frozenset[str]:
    """Return the uids of an object's owners."""
    uids = (owner.get("uid") for owner in parts(raw, "metadata", "ownerReferences"))
    return frozenset(uid for uid in uids if isinstance(uid, str) and uid)


def condition(raw: Any, kind: str) -> dict[str, Any]:
    """Return the condition of this type in the status of `raw`, or an empty object."""
    return next(
        (condition for condition in parts(raw, "status", "conditions") if condition.get("type") == kind), {}
    )


def holds(raw: Any, kind: str) -> bool:
    """Return whether a condition is True."""
    return condition(raw, kind).get("status") == "True"
