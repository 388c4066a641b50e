"""The lines of the trainer's log that `palaestra run` prints for a person."""

import pytest
import structlog

from palaestra.local.readable_log import readable
from palaestra_trainer.run.telemetry.logs import configure_logs

HEAD = "2026-11-27T17:23:06.142184Z "


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("[info     ] checkpoint written seconds=0.046 step=500", None),
        (
            "[warning  ] simulator fault fact='a0: closed the connection' kind=dead simulator=collect-0",
            "warning: simulator fault: a0: closed the connection (kind dead, simulator collect-0)",
        ),
        ("[error    ] disk full", "error: disk full"),
        ('[warning  ] odd what="it\'s a name" n=3', "warning: odd: it's a name (n 3)"),
        ("[warning  ] empty what=''", "warning: empty (what )"),
    ],
)
def test_values_are_progress_and_warnings_are_sentences(line, text):
    """The terminal shows only sentences, because a person reads it. The log file has all fields."""
    assert readable(HEAD + line) == text


@pytest.mark.parametrize("line", ["hello", "", "Traceback (most recent call last):", "[info     ] mine x=1"])
def test_output_of_the_users_code_stays_as_it_is(line):
    """Authors of environments use `print` to debug them."""
    assert readable(line) == line


def test_the_trainers_own_format_is_understood(capsys):
    """The trainer's own code writes these lines, so a change of its format makes the test fail."""
    configure_logs()
    log = structlog.get_logger("test")
    log.info("progress", step=1)
    log.warning("simulator fault", fact="it: died", kind="dead")

    quiet, loud = capsys.readouterr().err.splitlines()

    assert readable(quiet) is None
    assert readable(loud) == "warning: simulator fault: it: died (kind dead)"
