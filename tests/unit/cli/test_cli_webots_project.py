"""`palaestra webots-project`: the controller for Webots on a desktop."""

import subprocess
import sys

import pytest

from palaestra.cli import main


def test_the_project_starts_the_controller_with_this_python(tmp_path, capsys):
    """Webots reads the interpreter from the first line, and another interpreter may lack the package."""
    folder = tmp_path / "new" / "project"

    assert main(["webots-project", str(folder)]) == 0
    assert main(["webots-project", str(folder)]) == 0  # overwrites its own file

    controller = folder / "controllers" / "ros" / "ros.py"
    first = controller.read_text().partition("\n")[0]
    ended = subprocess.run(
        ["env", "-u", "WEBOTS_HOME", first.removeprefix("#!"), controller],
        capture_output=True,
        text=True,
        check=False,
    )
    assert first == f"#!{sys.executable}"
    assert (ended.returncode, "ros: WEBOTS_HOME is not set" in ended.stderr) == (2, True)
    assert capsys.readouterr().out == f"export WEBOTS_EXTRA_PROJECT_PATH={folder}\n" * 2


@pytest.mark.parametrize(("name", "text"), [("ros", ""), ("ros.py", "print('mine')"), ("helper.py", "")])
def test_a_controller_of_the_user_is_kept(tmp_path, capsys, name, text):
    """Webots prefers a user's binary to our script, and the command must not overwrite a user's script."""
    file = tmp_path / "controllers" / "ros" / name
    file.parent.mkdir(parents=True)
    file.write_text(text)

    assert main(["webots-project", str(tmp_path)]) == 2

    assert f"{file} belongs to another controller `ros`; give another folder" in capsys.readouterr().err
    assert file.read_text() == text


def test_a_folder_that_cannot_be_written_is_named(capsys):
    """A person must see one sentence with the remedy, not a traceback."""
    assert main(["webots-project", "/proc/project"]) == 2
    assert capsys.readouterr().err.endswith("give a folder in which you can write\n")
