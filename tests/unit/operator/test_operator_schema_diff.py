"""The fields of this release's definition that the cluster's definition lacks; extra fields are allowed."""

import copy

import pytest

from palaestra.api.crd import schema
from palaestra.operator.crd_check import lacks

OURS = schema()


def changed(change):
    """Return the fields that the definition lacks after this change."""
    served = copy.deepcopy(OURS)
    change(served["properties"]["status"]["properties"])
    return list(lacks(served, OURS))


def test_this_release_s_own_definition_lacks_nothing():
    """The comparison must not report a difference between equal definitions."""
    assert list(lacks(OURS, OURS)) == []


@pytest.mark.parametrize(
    ("change", "fact"),
    [
        (lambda status: status.pop("running"), "status.running: is missing"),
        (
            lambda status: status["replicas"]["items"]["properties"].pop("goodput"),
            "status.replicas[].goodput: is missing",
        ),
        (
            lambda status: status["step"].update(type="string"),
            "status.step: is of type string, not of type integer",
        ),
        (lambda status: status["phase"]["enum"].remove("Suspended"), "status.phase: lacks Suspended"),
    ],
)
def test_what_an_older_definition_lacks_is_named_with_its_path(change, fact):
    """The API server drops such a field or refuses the whole status, so an administrator must know it."""
    assert changed(change) == [fact]


def test_a_map_of_another_type_is_named():
    """The comparison also covers the values of maps and the items of lists."""
    served = {"type": "object", "additionalProperties": {"type": "string"}}
    ours = {"type": "object", "additionalProperties": {"type": "integer"}}

    assert list(lacks(served, ours, "status.m")) == ["status.m{}: is of type string, not of type integer"]


def test_what_a_newer_definition_has_besides_is_no_lack():
    """An administrator upgrades the definition before the operator."""
    assert changed(lambda status: status.update(ofTomorrow={"type": "string"})) == []
