"""The field manager that wrote a field of an object, as recorded in `metadata.managedFields`."""

from palaestra.observe.json_access import part, parts, text
from palaestra.observe.models import Raw

MOST_NAME = 128  # the API server's limit for a field manager's name


def suspends(raw: Raw) -> str:
    """Return the field manager that last set a Job's `spec.suspend`; "" if the object does not name it."""
    entries = [
        (text(entry, "time"), text(entry, "manager", MOST_NAME))
        for entry in parts(raw, "metadata", "managedFields")
        if "f:suspend" in part(entry, "fieldsV1", "f:spec")
    ]
    return max(entries, default=("", ""))[1]
