"""The operator finds unused claims, which it deletes together with their TrainingJob."""

import pytest

from palaestra.observe import trimmed
from palaestra.observe.claims import is_unused

LABELS = {"app.kubernetes.io/managed-by": "palaestra", "palaestra.dev/job-uid": "u"}
PENDING = {
    "kind": "PersistentVolumeClaim",
    "metadata": {"name": "job-0-u", "labels": LABELS},
    "spec": {"accessModes": ["ReadWriteOnce"]},
    "status": {"phase": "Pending"},
}


@pytest.mark.parametrize("kept", [dict, trimmed])
def test_a_claim_that_was_never_bound_is_unused(kept):
    """The cached copy of a claim keeps the fields that show whether the claim was bound."""
    assert is_unused(kept(PENDING))


@pytest.mark.parametrize(
    "change",
    [
        pytest.param({"status": {"phase": "Bound"}}, id="bound"),
        pytest.param({"status": {"phase": "Lost"}}, id="its volume is gone"),
        pytest.param({"status": {}}, id="not known yet"),
        pytest.param({"spec": {"volumeName": "pv-1"}}, id="promised a volume"),
        pytest.param({"spec": {"dataSource": {"kind": "VolumeSnapshot", "name": "run"}}}, id="restored"),
        pytest.param({"metadata": {"name": "runs", "labels": {}}}, id="of somebody else"),
        pytest.param(
            {"metadata": {"labels": LABELS, "deletionTimestamp": "2026-01-31T12:00:00Z"}}, id="being deleted"
        ),
    ],
)
def test_every_other_claim_may_hold_a_run(change):
    """In doubt the operator keeps a claim, because a deleted run is lost."""
    assert not is_unused(trimmed(PENDING | change))
