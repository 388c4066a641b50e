"""The pages about training from Python can be typed."""

from pathlib import Path

from tests.pages import blocks

ROOT = Path(__file__).parents[3]


def test_the_script_of_the_page_about_tools_trains(tmp_path, monkeypatch, capsys):
    """With the example that people have, in a folder of their own."""
    [script] = blocks((ROOT / "docs/tools.md").read_text(), "python with-a-run")
    (tmp_path / "manifests").symlink_to(ROOT / "manifests")
    monkeypatch.chdir(tmp_path)

    exec(compile(script, "docs/tools.md", "exec"), {})

    assert "True " in capsys.readouterr().out.splitlines()[-1]
    assert (tmp_path / "runs/tiny/0/model.zip").exists()
