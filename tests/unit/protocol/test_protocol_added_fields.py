"""Messages with a field that release 0.1.0 does not have."""

from dataclasses import dataclass
from typing import Annotated

import pytest

from palaestra_protocol.fields import ProtocolError
from palaestra_protocol.messages import AddedLater, JsonMessage, Number, Text, Whole


@dataclass(frozen=True, slots=True, kw_only=True)
class First(JsonMessage):
    """The message of the first release."""

    step: Annotated[int, Whole()]


@dataclass(frozen=True, slots=True, kw_only=True)
class Later(JsonMessage):
    """The same message with fields that a later release added."""

    step: Annotated[int, Whole()]
    loss: Annotated[float | None, AddedLater(Number(0.0))] = None
    note: Annotated[str | None, AddedLater(Text(5))] = None


def test_an_added_field_is_absent_unless_it_is_set() -> None:
    """Readers of the first release must understand a message that uses no new field."""
    assert Later(step=7).to_json() == First(step=7).to_json() == {"step": 7}


def test_an_added_field_that_is_set_is_written_within_its_bounds_and_read_back() -> None:
    """The writer cuts a text that is too long, as it does for every other field."""
    content = Later(step=7, loss=0.5, note="too long").to_json()

    assert content == {"step": 7, "loss": 0.5, "note": "too l"}
    assert Later.from_json(content) == Later(step=7, loss=0.5, note="too l")


def test_both_releases_read_each_other() -> None:
    """The images of one job may be of different releases, so each must read messages of the other."""
    assert First.from_json(Later(step=7, loss=0.5).to_json()) == First(step=7)
    assert Later.from_json(First(step=7).to_json()) == Later(step=7)


def test_an_added_field_with_a_wrong_value_is_refused() -> None:
    """The field may be absent, but a wrong value is an error, as for any other field."""
    with pytest.raises(ProtocolError, match=r"^loss: is not between 0 and inf$"):
        Later.from_json({"step": 7, "loss": -1})
