"""The commands of the pages about a first run, training from Python and sweeps work as written."""

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
    """These are the first two commands that a new reader types."""
    (tmp_path / "manifests").symlink_to(ROOT / "manifests")
    [commands] = blocks(LAPTOP, "sh")

    printed = Terminal(tmp_path, path=PALAESTRA.parent).type_in(commands, TYPED_S)

    assert (tmp_path / "runs/tiny/0/model.zip").exists()
    assert '"episodes": 5' in printed


def test_the_script_of_the_page_about_python_trains(tmp_path, monkeypatch, capsys):
    """The script uses the example that users have, in a separate folder."""
    [script] = blocks((ROOT / "docs/howto/python.md").read_text(), "python with-a-run")
    (tmp_path / "manifests").symlink_to(ROOT / "manifests")
    monkeypatch.chdir(tmp_path)

    exec(compile(script, "docs/howto/python.md", "exec"), {})

    assert "True " in capsys.readouterr().out.splitlines()[-1]
    assert (tmp_path / "runs/tiny/0/model.zip").exists()


@pytest.fixture
def sweep(tmp_path, monkeypatch):
    """Return a function that writes the sweep with a given fence on the page, next to the examples."""
    (tmp_path / "manifests").symlink_to(ROOT / "manifests")
    monkeypatch.chdir(tmp_path)

    def write(fence):
        [text] = blocks(SWEEPS, fence)
        (tmp_path / "sweep.yaml").write_text(text)
        return Path("sweep.yaml")

    return write


def test_the_first_sweep_of_the_page_trains_and_compares(sweep, tmp_path, capsys):
    """The real trainer trains two trials of an example as on the page, here with one seed each."""
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
    """Every job of a matrix is checked; of a search, the jobs at its bounds."""
    assert len(trials(load(sweep(fence)))) == count


def test_the_page_explains_every_field():
    """The table is below the first sweep."""
    assert all(f"| `{name}` |" in SWEEPS for name in SweepSpec.model_fields)
