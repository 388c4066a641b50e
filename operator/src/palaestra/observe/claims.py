"""Claims that were never bound to a volume, so that their deletion loses no data."""

from palaestra.observe.json_access import part, text
from palaestra.observe.models import Raw

MANAGED = "app.kubernetes.io/managed-by"
FIELDS = ("volumeName", "dataSource", "dataSourceRef")  # the fields of a claim's spec that this module reads


def is_unused(raw: Raw) -> bool:
    """Return whether a claim that the operator created was never bound, and is not being deleted.

    A claim with a data source is being restored, and its volume may not exist yet.
    """
    metadata = part(raw, "metadata")
    ours = part(metadata, "labels").get(MANAGED) == "palaestra" and "deletionTimestamp" not in metadata
    pending = text(part(raw, "status"), "phase") == "Pending"
    return ours and pending and not any(part(raw, "spec").get(field) for field in FIELDS)
