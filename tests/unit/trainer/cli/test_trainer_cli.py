"""The programs of the trainer package, as far as they can be tested without a simulator."""

from __future__ import annotations

import io
import subprocess
import sys

import pytest

from palaestra_protocol.pod.status import Termination
from palaestra_trainer.cli.compare import compare
from palaestra_trainer.cli.evaluate import evaluate
from palaestra_trainer.cli.train import train
from palaestra_trainer.cli.try_episodes import attempt
from palaestra_trainer.errors import FaultBudgetSpent, MasterLost, SimulatorHung

WRONG = "job: x\nsteps: 0\nenvironment: {id: A-v0}\nsimulators: []\n"


@pytest.fixture(autouse=True)
def nothing_given(monkeypatch):
    """Remove the variables that the shell of a developer may have set."""
    for name in ("PALAESTRA_CONFIG", "PALAESTRA_RUN", "PALAESTRA_TERMINATION_LOG"):
        monkeypatch.delenv(name, raising=False)


@pytest.mark.parametrize(
    ("program", "codes"),
    [
        (train, [0, 2, 75, 80, 81, 82, 1]),
        (evaluate, [0, 2, 80, 130, 1]),
        (compare, [0, 2, 3, 80, 130, 1]),
        (attempt, [0, 1, 2, 80, 130]),
    ],
    ids=["train", "eval", "compare", "try"],
)
def test_help_says_what_is_read_and_written_and_the_exit_codes(program, codes, capsys):
    """A person must find files and exit codes without reading the source."""
    with pytest.raises(SystemExit) as ended:
        program(["--help"])

    text = capsys.readouterr().out
    assert ended.value.code == 0
    for word in ("reads:", "writes:", "training.yaml" if program is not train else "PALAESTRA_CONFIG"):
        assert word in text
    _, _, listed = text.partition("exit codes:")
    assert [int(line.split()[0]) for line in listed.split("\n") if line] == codes


@pytest.mark.parametrize("number", ["0", "-1", "many"])
def test_an_evaluation_of_no_episodes_is_refused(number, capsys):
    """The number is checked before a simulator starts, so a person waits only a moment for the error."""
    with pytest.raises(SystemExit) as ended:
        evaluate(["run", "--episodes", number])

    assert ended.value.code == 2
    assert "argument --episodes" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (KeyboardInterrupt(), 130),
        (FaultBudgetSpent("evaluate-0: 10 restarts"), 80),
        (MasterLost("no ROS master"), 1),
        (SimulatorHung("evaluate-0", "slow"), 1),
    ],
    ids=lambda it: type(it).__name__,
)
def test_an_evaluation_that_is_cut_ends_with_a_line_and_its_own_code(error, code, capsys, monkeypatch):
    """An evaluation saves nothing from which it could resume, so it has other exit codes than a training."""

    def cut(*_):
        raise error

    monkeypatch.setattr("palaestra_trainer.cli.evaluate._evaluate", cut)

    ended = evaluate(["run"])

    assert ended == code
    assert len(capsys.readouterr().err.splitlines()) == 1


def test_a_wrong_configuration_ends_with_2_and_a_line_for_each_mistake(tmp_path, capsys, monkeypatch):
    """A traceback would hide the mistakes. The operator reads the same lines from the termination message."""
    monkeypatch.setenv("PALAESTRA_TERMINATION_LOG", str(tmp_path / "word"))
    (tmp_path / "training.yaml").write_text(WRONG)

    code = train(["--config", str(tmp_path / "training.yaml"), "--run", str(tmp_path / "run")])

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
        (train, [], "PALAESTRA_CONFIG: is not set"),
        (train, ["--config", "training.yaml"], "training.yaml: cannot be read"),
        (evaluate, ["run"], "run: has no training.yaml"),
        (compare, ["a", "b"], "a: has no training.yaml"),
        (attempt, ["run"], "run: has no training.yaml"),
    ],
)
def test_what_is_missing_is_named_and_nothing_made(program, arguments, fact, capsys, monkeypatch, tmp_path):
    """A pod sets the variables, but a person types the command by hand."""
    monkeypatch.chdir(tmp_path)

    code = program(arguments)

    assert code == 2
    assert fact in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == []


def test_a_wrong_configuration_is_refused_before_a_learning_library_is_imported(tmp_path):
    """An import of PyTorch takes three seconds, which is long for a typing error."""
    (tmp_path / "training.yaml").write_text(WRONG)
    program = (
        "import sys; from palaestra_trainer.cli.train import train\n"
        f"code = train(['--config', {str(tmp_path / 'training.yaml')!r}])\n"
        "sys.exit(9 if 'torch' in sys.modules else code)"
    )

    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=60, check=False)

    assert ended.returncode == 2


@pytest.mark.parametrize(
    ("program", "arguments", "words"),
    [
        (evaluate, ["run", "--in", "stub,gazebo"], "'gazebo' is not a simulator; choose from stub, mujoco"),
        (evaluate, ["run", "--json"], "--json: has an effect only with --in; without --in"),
        (compare, ["a", "b", "--margin", "5"], "'5' is not a number between 0 and 1, such as 0.05"),
        (compare, ["a", "b", "--in", "gazebo"], "argument --in: invalid choice"),
    ],
)
def test_an_option_without_meaning_is_refused_by_its_name(program, arguments, words, capsys):
    """If the option were ignored, a person would believe that it had an effect."""
    with pytest.raises(SystemExit) as ended:
        program(arguments)

    assert ended.value.code == 2
    assert words in capsys.readouterr().err


def test_a_pod_evaluates_in_its_own_simulators_only(tmp_path, capsys, monkeypatch):
    """The image of a trainer contains no simulator."""
    path = tmp_path / "training.yaml"
    path.write_text(
        "job: x\nsteps: 1\nenvironment: {id: A-v0}\n"
        "simulators: [{name: c-0, group: c, index: 0, role: Collect}]\n"
    )
    monkeypatch.setenv("PALAESTRA_CONFIG", str(path))

    code = evaluate([str(tmp_path), "--in", "stub"])

    assert code == 2
    assert "--in: a pod evaluates in its own simulators; remove the option" in capsys.readouterr().err


def test_keys_are_read_from_a_terminal_only(tmp_path, capsys, monkeypatch):
    """Without a terminal, the program would wait for a key for ever."""
    monkeypatch.setattr("sys.stdin", io.StringIO())

    code = attempt([str(tmp_path), "--agent", "keyboard"])

    assert code == 2
    assert "--agent keyboard: the standard input is not a terminal" in capsys.readouterr().err
