"""The commands on the pages about a first run, training from Python, and sweeps work as written."""

from pathlib import Path

import pytest

from palaestra.cli import main
from palaestra.sweeps.grid import trials
from palaestra.sweeps.model import SweepSpec, load
from tests.local_run import PALAESTRA
from tests.pages import blocks
from tests.terminal import Terminal

ROOT = Path(__file__).parents[3]
SWEEPS = (ROOT / "docs/howto/sweeps.md").read_text()
LAPTOP = (ROOT / "docs/start/laptop.md").read_text()
TYPED_S = 300


@pytest.mark.timeout(400)
def test_the_first_run_of_the_page_about_a_laptop_trains_and_is_measured(tmp_path):
    """A new reader types these two commands first."""
    (tmp_path / "manifests").symlink_to(ROOT / "manifests")
    [commands] = blocks(LAPTOP, "sh")

    printed = Terminal(tmp_path, path=PALAESTRA.parent).type_in(commands, TYPED_S)

    assert (tmp_path / "runs/tiny/0/model.zip").exists()
    assert '"episodes": 5' in printed


def test_the_script_of_the_page_about_python_trains(tmp_path, monkeypatch, capsys):
    """A reader copies the script into a folder with the examples, and runs it."""
    [script] = blocks((ROOT / "docs/howto/python.md").read_text(), "python with-a-run")
    (tmp_path / "manifests").symlink_to(ROOT / "manifests")
    monkeypatch.chdir(tmp_path)

    exec(compile(script, "docs/howto/python.md", "exec"), {})

    assert "True " in capsys.readouterr().out.splitlines()[-1]
    assert (tmp_path / "runs/tiny/0/model.zip").exists()


@pytest.fixture
def sweep(tmp_path, monkeypatch):
    """Return a function that writes the page's sweep with this fence into a folder with the examples."""
    (tmp_path / "manifests").symlink_to(ROOT / "manifests")
    monkeypatch.chdir(tmp_path)

    def write(fence):
        [text] = blocks(SWEEPS, fence)
        (tmp_path / "sweep.yaml").write_text(text)
        return Path("sweep.yaml")

    return write


def test_the_first_sweep_of_the_page_trains_and_compares(sweep, tmp_path, capsys):
    """The real trainer trains the page's two trials, but with one seed each to save time."""
    [console] = blocks(SWEEPS, "console")
    typed = console.removeprefix("$ palaestra ").split()
    file = sweep("yaml sweep")
    file.write_text(file.read_text().replace("seeds: 2", "seeds: 1"))

    code = main(typed)

    out = capsys.readouterr().out
    assert code == 0, out
    assert "best: rates-" in out
    assert len(list(tmp_path.glob("runs/rates/rates-?/?/model.zip"))) == 2
    assert (tmp_path / "runs/rates/curves.png").exists()


@pytest.mark.parametrize(("fence", "count"), [("yaml sweep-at-random", 20), ("yaml sweep-by-optuna", 2)])
def test_the_other_sweeps_of_the_page_are_right(sweep, fence, count):
    """A reader copies these sweeps too.

    For a matrix, the test checks all jobs. For a search, it checks the jobs at the bounds of the ranges.
    """
    assert len(trials(load(sweep(fence)))) == count


def test_the_page_explains_every_field():
    """A reader looks up a field of a sweep in the table on this page."""
    assert all(f"| `{name}` |" in SWEEPS for name in SweepSpec.model_fields)
