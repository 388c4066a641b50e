"""What a served definition lacks of this release's, and what it may have besides."""

import copy

import pytest

from palaestra.api.crd import schema
from palaestra.api.schema_diff import lacks

OURS = schema()


def changed(change):
    """Return what a definition lacks that was changed so."""
    served = copy.deepcopy(OURS)
    change(served["properties"]["status"]["properties"])
    return list(lacks(served, OURS))


def test_this_release_s_own_definition_lacks_nothing():
    """An installation as it should be."""
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
    """The API server drops such a field, or refuses the status."""
    assert changed(change) == [fact]


def test_a_map_of_another_type_is_named():
    """Maps and lists are looked into."""
    served = {"type": "object", "additionalProperties": {"type": "string"}}
    ours = {"type": "object", "additionalProperties": {"type": "integer"}}

    assert list(lacks(served, ours, "status.m")) == ["status.m{}: is of type string, not of type integer"]


def test_what_a_newer_definition_has_besides_is_no_lack():
    """An administrator applies it before the operators are upgraded."""
    assert changed(lambda status: status.update(ofTomorrow={"type": "string"})) == []
