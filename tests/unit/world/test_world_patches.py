"""The generator verifies that each of its patches has exactly the declared effect."""

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.world.patches import Patch, edited
from palaestra_sim.world.source import Source
from palaestra_sim.world.tokens import tokenize

SOURCE = Source(data=b"Robot { name TRUE }", name="my.wbt")


def change(*edits: Patch) -> bytes:
    """Return the source with these patches applied."""
    return edited(SOURCE, tokenize(SOURCE), edits)


def test_edits_replace_insert_and_remove_tokens() -> None:
    """Patches are applied in source order, and the text between them is copied."""
    replace = Patch(start=0, end=5, text=b"Pose", tokens=(b"Pose",))
    insert = Patch(start=7, end=7, text=b" a 1", tokens=(b"a", b"1"))
    remove = Patch(start=7, end=17, text=b"", tokens=())

    assert change() == SOURCE.data
    assert change(replace, insert) == b"Pose { a 1 name TRUE }"
    assert change(remove) == b"Robot { }"


@pytest.mark.parametrize(
    "edit",
    [
        pytest.param(Patch(start=12, end=12, text=b"s", tokens=(b"s",)), id="glued to a word"),
        pytest.param(Patch(start=7, end=7, text=b"#", tokens=()), id="hides the rest in a comment"),
        pytest.param(Patch(start=7, end=7, text=b" 1 2", tokens=(b"1",)), id="too many tokens"),
        pytest.param(Patch(start=7, end=7, text=b" 1", tokens=(b"1", b"2")), id="too few tokens"),
    ],
)
def test_an_edit_that_does_not_do_what_it_says_is_refused(edit: Patch) -> None:
    """Without this check, only a simulator would notice the wrong world."""
    with pytest.raises(WorldError, match=r"my\.wbt:1:\d+: the generated world has .* was meant"):
        change(edit)
