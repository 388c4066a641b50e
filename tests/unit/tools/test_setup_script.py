"""`make setup` and `make test` for a person who may not install packages of the distribution."""

import os
import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

TOOLS = Path(__file__).parents[3] / "tools"
LINE = "  sudo apt-get update && sudo apt-get install -y --no-install-recommends"
WITHOUT_ENSUREPIP = (
    "/usr/bin/python3 cannot make an environment without ensurepip. "
    "Install uv, or type this line; then repeat the command:"
)
PACKAGES = (
    "python3-rospy python3-rosmaster python3-netifaces "
    "python3-rosmsg python3-rosservice python3-rostopic python3-sensor-msgs ros-sensor-msgs "
    "ros-nav-msgs ros-std-srvs "
    "g++ libroscpp-dev libsensor-msgs-dev python3-gencpp libegl1 libgl1-mesa-dri libopengl0 chromium"
)
NOBODY = ("setpriv", "--reuid", "65534", "--clear-groups")


@pytest.fixture
def checkout():
    """Yield a folder with the scripts, writable for everyone, and with modules that cannot be imported."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder)
        (path / "modules").mkdir()
        (path / "tools").mkdir()
        for name in ("setup.sh", "test-packages.sh"):
            shutil.copy(TOOLS / name, path / "tools" / name)
        for name in ("rospy", "ensurepip"):
            (path / "modules" / f"{name}.py").write_text("raise ImportError\n")
        (path / "requirements.lock").write_text("uv==0.9.0\n")
        for each in (path, *path.rglob("*")):
            each.chmod(0o777)
        yield path


@pytest.mark.parametrize(
    ("script", "lines"),
    [
        (
            "setup.sh",
            [
                WITHOUT_ENSUREPIP,
                f"{LINE} python3-venv",
            ],
        ),
        (
            "test-packages.sh",
            [
                "Packages for the tests are missing. Type this line, then repeat the command:",
                f"{LINE} {PACKAGES}",
            ],
        ),
    ],
)
def test_without_root_it_prints_the_one_line_to_type_and_stops(checkout, script, lines):
    """The scripts install nothing without the person's knowledge. Only the tests need ROS."""
    before = sorted(checkout.rglob("*"))

    done = subprocess.run(
        [*(NOBODY if os.geteuid() == 0 else ()), checkout / "tools" / script],
        env={
            **os.environ,
            "PATH": "/usr/bin:/bin",
            "PYTHONPATH": str(checkout / "modules"),
            "PYTHONDONTWRITEBYTECODE": "1",
        },
        capture_output=True,
        text=True,
        timeout=60,
        check=False,
    )

    assert (done.returncode, done.stderr) == (1, "")
    assert done.stdout.splitlines() == lines
    assert sorted(checkout.rglob("*")) == before


UV = """\
#!/bin/bash
echo "$*" >>uv.log
[[ $* == "pip freeze" ]] && cat freeze.txt
while (($#)); do [[ $1 == -r ]] && cat "$2" >>installed.lock; shift; done
true
"""
LOCK = """\
uv==0.9.0 \\
    --hash=sha256:aa
    # via palaestra
nvidia-nccl-cu12==2.21.5 ; sys_platform == 'linux' \\
    --hash=sha256:bb
    # via torch
torch==2.6.0 \\
    --hash=sha256:cc
triton==3.2.0 ; sys_platform == 'linux' \\
    --hash=sha256:dd
types-torch==1.0 \\
    --hash=sha256:ee
"""
SMALL_LOCK = """\
uv==0.9.0 \\
    --hash=sha256:aa
    # via palaestra
types-torch==1.0 \\
    --hash=sha256:ee
"""
INDEX = "file:///wheels"
EDITABLE = "pip install --quiet --no-deps --no-build-isolation -e operator -e trainer -e sim_image"


@pytest.fixture
def set_up(tmp_path):
    """`set_up(TORCH_INDEX=...)` returns the output of setup.sh and the commands of a fake `uv`."""
    (tmp_path / "tools").mkdir()
    (tmp_path / ".venv/bin").mkdir(parents=True)
    shutil.copy(TOOLS / "setup.sh", tmp_path / "tools/setup.sh")
    shutil.copy(TOOLS.parent / "Makefile", tmp_path / "Makefile")
    (tmp_path / "requirements.lock").write_text(LOCK)
    (tmp_path / "freeze.txt").write_text("")
    for name, text in {"uv": UV, "python": "#!/bin/bash\nfalse\n"}.items():
        (tmp_path / ".venv/bin" / name).write_text(text)
        (tmp_path / ".venv/bin" / name).chmod(0o755)

    def run(*words, **variables):
        for name in ("uv.log", "installed.lock"):
            (tmp_path / name).unlink(missing_ok=True)
        done = subprocess.run(
            words or ["tools/setup.sh"],
            cwd=tmp_path,
            env={"PATH": os.environ["PATH"], "HOME": str(tmp_path), **variables},
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
        assert done.returncode == 0, done.stderr
        log = tmp_path / "uv.log"
        return done.stdout, log.read_text().splitlines() if log.exists() else []

    return run


def test_the_size_of_the_download_is_said_before_it_begins(set_up):
    """On a slow line, 3 GB take an hour.

    The printed page explains how to install a smaller PyTorch on a machine without a GPU.
    """
    printed, commands = set_up()

    assert "3 GB to download" in printed
    assert "docs/start/laptop.md" in printed
    assert commands == ["pip install --quiet --require-hashes -r requirements.lock", EDITABLE]


def test_with_an_index_pytorch_comes_from_there_and_cuda_is_left_out(set_up, tmp_path):
    """Only PyTorch comes from that index; all other packages keep their hashes."""
    printed, commands = set_up(TORCH_INDEX=INDEX)

    assert f"torch==2.6.0 from {INDEX} (a build for the processor alone is 0.2 GB)" in printed
    assert commands == [
        "pip install --quiet --require-hashes --no-deps -r .venv/without-torch.lock",
        "pip freeze",
        f"pip install --quiet --no-deps --index-url {INDEX} torch==2.6.0",
        EDITABLE,
    ]
    assert (tmp_path / "installed.lock").read_text() == SMALL_LOCK


def test_the_index_is_kept_and_cuda_is_removed(set_up, tmp_path):
    """A later `make setup` without the variable must neither keep CUDA nor download its 3 GB again."""
    (tmp_path / "freeze.txt").write_text(
        "nvidia-nccl-cu12==2.21.5\nnumpy==2.0.0\ntorch==2.6.0\ntriton==3.2.0\n"
    )

    set_up(TORCH_INDEX=INDEX)
    _, commands = set_up()

    assert "pip uninstall --quiet nvidia-nccl-cu12 triton torch" in commands
    assert f"pip install --quiet --no-deps --index-url {INDEX} torch==2.6.0" in commands


def test_make_installs_again_only_for_another_index(set_up, tmp_path):
    """A person may set the variable permanently, and `make run` must still start at once."""
    for package in ("operator", "trainer", "sim_image"):
        (tmp_path / package).mkdir()
        (tmp_path / package / "pyproject.toml").touch()
    for source in ("palaestra_protocol/ros/definitions.txt", "palaestra_sim/message_package/files.py"):
        (tmp_path / "sim_image/src" / source).parent.mkdir(parents=True)
        (tmp_path / "sim_image/src" / source).touch()

    commands = [
        set_up("make", "setup", *words)[1]
        for words in ([], [], [f"TORCH_INDEX={INDEX}"], [f"TORCH_INDEX={INDEX}"], [])
    ]

    assert [len(each) for each in commands] == [2, 0, 4, 0, 0]


def test_the_page_names_the_pytorch_that_the_trainer_accepts():
    """If the command on the page installed another version, pip would replace it by the large build."""
    root = TOOLS.parent
    required = re.search(r'"(torch[^"]+)"', (root / "trainer/pyproject.toml").read_text())

    assert f"pip install '{required[1]}' --index-url" in (root / "docs/start/laptop.md").read_text()
