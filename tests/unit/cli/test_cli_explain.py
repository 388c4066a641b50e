"""The output and the errors of `palaestra explain`."""

import json
import shlex
from pathlib import Path

import pytest

from palaestra.cli import main
from tests.pages import blocks

PAGE = (Path(__file__).parents[3] / "docs/reference/trainingjob.md").read_text(encoding="utf-8")


def test_a_field_is_printed_in_the_width_of_the_terminal(capsys, monkeypatch):
    """Like `kubectl explain`, the command breaks the lines at the width of the terminal."""
    monkeypatch.setenv("COLUMNS", "60")

    assert main(["explain", "simulators.role"]) == 0

    assert capsys.readouterr().out == (
        "spec.simulators[].role: Collect | Evaluate; required\n\n"
        "  `Collect`: the policy learns from the episodes.\n"
        "  `Evaluate`: the episodes only measure the policy.\n"
    )


def test_a_field_that_does_not_exist_is_one_sentence(capsys):
    """The message proposes the nearest field.

    Standard output stays empty, so that a pipe receives nothing.
    """
    assert main(["explain", "trainer.step\x1b[2J"]) == 2
    assert main(["explain", "trainer.step"]) == 2

    out, err = capsys.readouterr()
    assert out == ""
    assert err.splitlines()[1:] == [
        "trainer.step: is not a field of a TrainingJob; did you mean spec.trainer.steps?"
    ]
    assert "\x1b" not in err


@pytest.mark.parametrize("typed", blocks(PAGE, "sh")[0].splitlines())
def test_the_commands_of_the_page_print_what_it_says(typed, capsys):
    """A reader of the page types these commands before the first job."""
    words = shlex.split(typed.partition(" >")[0])

    assert words[0] == "palaestra"
    assert main(words[1:]) == 0

    out = capsys.readouterr().out
    if "--json" in words:
        assert json.loads(out)["properties"]["spec"]["x-palaestra-rules"]
    else:
        assert "Fields:\n" in out
