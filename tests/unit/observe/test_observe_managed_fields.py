"""The operator reads the last writer of a field from managedFields, whose content it does not trust."""

import pytest

from palaestra.observe.jobs import suspends


def entry(manager, field="f:suspend", time="2026-01-31T12:00:00Z"):
    """Return an entry of managedFields with the field that a manager has written."""
    return {"manager": manager, "operation": "Update", "time": time, "fieldsV1": {"f:spec": {field: {}}}}


def test_the_manager_of_the_field_is_found():
    """The user must learn which program suspended the Job.

    The other managers of the Job have written other fields.
    """
    fields = [entry("palaestra", "f:backoffLimit"), entry("kueue"), entry("kubectl-edit", "f:parallelism")]

    assert suspends({"metadata": {"managedFields": fields}}) == "kueue"


def test_of_several_managers_it_is_the_last():
    """Two managers that apply the same value share the ownership of a field. The later one is named."""
    fields = [entry("kueue", time="2026-01-31T12:00:01Z"), entry("palaestra")]

    assert suspends({"metadata": {"managedFields": fields}}) == "kueue"


@pytest.mark.parametrize(
    "fields",
    [None, "kueue", [None, {}, {"manager": 1}], [{**entry("x"), "fieldsV1": {"f:spec": None}}]],
    ids=["absent", "no list", "no entries", "no fields"],
)
def test_what_does_not_tell_is_nobody(fields):
    """Any content may be stored in managedFields, and the operator must not fail."""
    assert suspends({"metadata": {"managedFields": fields}}) == ""
