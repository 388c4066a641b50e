"""`palaestra-train` and `palaestra-eval`, as far as they need no simulator."""

from __future__ import annotations

import subprocess
import sys

import pytest

from palaestra_sim.protocol.status import Termination
from palaestra_trainer import cli

WRONG = "job: x\nsteps: 0\nenvironment: {id: A-v0}\nsimulators: []\n"


@pytest.fixture(autouse=True)
def nothing_given(monkeypatch):
    """Forget what the shell of whoever runs the tests has set."""
    for name in ("PALAESTRA_CONFIG", "PALAESTRA_RUN", "PALAESTRA_TERMINATION_LOG"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize("program", [cli.train, cli.evaluate])
def test_help_says_what_is_read_and_written_and_the_exit_codes(program, capsys):
    """Nobody should have to read the source for that."""
    with pytest.raises(SystemExit) as ended:
        program(["--help"])

    text = capsys.readouterr().out
    assert ended.value.code == 0
    for word in ("reads:", "writes:", "exit codes:", "PALAESTRA_CONFIG", "75"):
        assert word in text


def test_a_wrong_configuration_ends_with_2_and_a_line_for_each_mistake(tmp_path, capsys, monkeypatch):
    """And with no traceback; the last word has them too."""
    monkeypatch.setenv("PALAESTRA_TERMINATION_LOG", str(tmp_path / "word"))
    (tmp_path / "training.yaml").write_text(WRONG)

    code = cli.train(["--config", str(tmp_path / "training.yaml"), "--run", str(tmp_path / "run")])

    text = capsys.readouterr().err
    assert code == 2
    assert "training.yaml: steps: 0 is refused" in text
    assert "training.yaml: simulators:" in text
    assert "Traceback" not in text
    assert "steps: 0 is refused" in Termination.from_message((tmp_path / "word").read_text()).reason
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("program", "arguments", "fact"),
    [
        (cli.train, [], "PALAESTRA_CONFIG: is not set"),
        (cli.train, ["--config", "training.yaml"], "training.yaml: cannot be read"),
        (cli.evaluate, ["run"], "run/training.yaml: cannot be read"),
    ],
)
def test_what_is_missing_is_named_and_nothing_made(program, arguments, fact, capsys, monkeypatch, tmp_path):
    """The variables are set in a pod; a person types the programs by hand."""
    monkeypatch.chdir(tmp_path)

    code = program(arguments)

    assert code == 2
    assert fact in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_wrong_configuration_is_told_before_a_learning_library_is_imported(tmp_path):
    """Three seconds are long for a typing mistake."""
    (tmp_path / "training.yaml").write_text(WRONG)
    program = (
        "import sys; from palaestra_trainer import cli\n"
        f"code = cli.train(['--config', {str(tmp_path / 'training.yaml')!r}])\n"
        "sys.exit(9 if 'torch' in sys.modules else code)"
    )

    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=60, check=False)

    assert ended.returncode == 2
