"""Find claims that were never bound to a volume; the deletion of such a claim loses no data."""

from palaestra.observe.json_access import part, text
from palaestra.observe.models import Raw

MANAGED = "app.kubernetes.io/managed-by"
FIELDS = ("volumeName", "dataSource", "dataSourceRef")  # the fields of a claim's spec that this module reads


def is_unused(raw: Raw) -> bool:
    """Return whether the operator created a claim that was never bound and that nobody has deleted.

    A claim with a data source is not unused: it is being restored, and its volume may not exist yet.
    """
    metadata = part(raw, "metadata")
    ours = part(metadata, "labels").get(MANAGED) == "palaestra" and "deletionTimestamp" not in metadata
    pending = text(part(raw, "status"), "phase") == "Pending"
    return ours and pending and not any(part(raw, "spec").get(field) for field in FIELDS)
