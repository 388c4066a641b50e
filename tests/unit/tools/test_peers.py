"""The measured chapters of docs/explain/peers.md."""

import json
from pathlib import Path

from tools.peers.page import AGAIN, MEASURED, RECORDED, chapters

ROOT = Path(__file__).parents[3]


def recorded(*, ours=2.0, theirs=4.0, load=0.1):
    """Return the record of one part, `plain`."""
    return {
        "plain": {
            "command": "python -m tests.bench plain",
            "figures": {"seconds": ours, "plain_seconds": theirs, "subproc_seconds": theirs},
            "load": [load, load],
            "machine": {"processor": "some", "processors": 2},
            "versions": {"Python": "3.11"},
        }
    }


def test_a_row_has_both_figures_and_their_ratio():
    """A reader checks the ratio from the two figures."""
    text = chapters(recorded(ours=2.0, theirs=4.0))

    assert "| plain Stable-Baselines3 | 2 s | 4 s | 0.50 |" in text
    assert "in which Palaestra loses" not in text


def test_a_row_that_loses_stays_and_has_its_reason():
    """Without its losses, the page would be an advertisement."""
    text = chapters(recorded(ours=6.0, theirs=4.0))

    assert "| plain Stable-Baselines3 | 6 s | 4 s | **1.50** |" in text
    assert (
        "in which Palaestra loses are bold. The parts of the difference are in [a whole run](speed.md" in text
    )


def test_figures_of_a_busy_machine_are_marked():
    """A load delays the programs that exchange many messages more than others."""
    assert AGAIN in chapters(recorded(load=1.5))
    assert AGAIN not in chapters(recorded(load=0.5))


def test_a_part_that_is_not_recorded_has_a_chapter_with_its_command():
    """A part can be measured alone, and without RLlib. A reader sees what is missing."""
    text = chapters(recorded())

    assert text.count("Not measured yet; the command is") == len(MEASURED)  # one is recorded, RLlib is not
    assert "--record docs/explain/peers.json goodput`" in text


def test_every_recorded_part_has_the_figures_of_its_rows():
    """A part that prints a figure under another name would break the page."""
    found = json.loads((ROOT / RECORDED).read_text())

    assert all(
        figure(found[chapter.part]["figures"]) >= 0
        for chapter in MEASURED
        if chapter.part in found
        for row in chapter.rows(found[chapter.part]["figures"])
        for figure in (row.ours, row.theirs)
    )
