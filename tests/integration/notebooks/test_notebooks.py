"""The notebooks of examples/notebooks run from top to bottom in a kernel, as JupyterLab runs them."""

import json
import os
import shutil
import sys
import uuid
from pathlib import Path

import nbformat
import pytest
import yaml
from jupyter_client.manager import start_new_kernel
from nbclient import NotebookClient

import palaestra
from palaestra.live_view.source import ViewError
from tests.local_run import running
from tests.waiting import eventually

ROOT = Path(__file__).parents[3]
NOTEBOOKS = ROOT / "examples" / "notebooks"
CELL_S, ENDS_S = 280, 60
# Each notebook, with texts that its cells print.
ORDER = {
    "1-drive.ipynb": ("of simulated time, cylinders at (1.2, 0.6)", "the wheel has turned by"),
    "2-environment.ipynb": ("Stable-Baselines3 has no complaint", "no problem found"),
    "3-train-and-watch.ipynb": ("<iframe src=", "trained 4096 steps", "success rate "),
    "4-evaluate.ipynb": ("arrived after", '"success_interval"', "image/gif", "action in the middle of the"),
}
AT_WORK = """
import palaestra
from palaestra_trainer.webots import Webots

job = {
    "apiVersion": "palaestra.dev/v1alpha1",
    "kind": "TrainingJob",
    "metadata": {"name": "interrupted"},
    "spec": {"trainer": {"environment": {"id": "MoveToTargetEnv-v0"}, "steps": 10**6}},
}
webots = Webots("robotino", "arena")
webots.start()
run = palaestra.run(job)
view = palaestra.show(run.directory)
print("at work", flush=True)
run.wait(600)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Return the working folder of a reader who runs all notebooks, with Palaestra's programs on the PATH."""
    made = tmp_path_factory.mktemp("reader")
    for path in NOTEBOOKS.iterdir():
        shutil.copy(path, made)
    return made


@pytest.fixture(autouse=True)
def surroundings(monkeypatch):
    """Let kernels find this environment's programs, and no ROS master of another test."""
    monkeypatch.setenv("PATH", f"{Path(sys.executable).parent}:{os.environ['PATH']}")
    for name in [name for name in os.environ if name.startswith("ROS_")]:
        monkeypatch.delenv(name)


@pytest.mark.minutes(2)
@pytest.mark.timeout(600)
@pytest.mark.parametrize("time", ["first", "second"])
@pytest.mark.parametrize("name", ORDER)
def test_every_notebook_runs_from_top_to_bottom_also_a_second_time(folder, name, time):
    """The cells must work in a kernel's running event loop, and while the files of an earlier time exist."""
    del time
    notebook = nbformat.read(folder / name, as_version=4)
    assert not any(cell.get("outputs") for cell in notebook.cells)

    NotebookClient(notebook, timeout=CELL_S, resources={"metadata": {"path": str(folder)}}).execute()

    printed = json.dumps([cell.get("outputs", []) for cell in notebook.cells], ensure_ascii=False)
    for text in ORDER[name]:
        assert text.replace('"', '\\"') in printed
    assert '"stderr"' not in printed


@pytest.mark.parametrize("end", ["interrupt", "kill"])
def test_an_interrupted_cell_and_a_killed_kernel_leave_no_process(tmp_path, end, monkeypatch):
    """The kernel's simulator, training and page are separate processes, which must end with the kernel."""
    mark = uuid.uuid4().hex
    monkeypatch.setenv("PALAESTRA_TEST_MARK", mark)
    kernel, client = start_new_kernel(cwd=str(tmp_path))
    try:
        request = client.execute(AT_WORK)
        while client.get_iopub_msg(timeout=CELL_S)["content"].get("text") != "at work\n":
            pass
        assert len(marked(mark)) > 4
        if end == "interrupt":
            kernel.interrupt_kernel()
            assert reply_to(client, request)["ename"] == "KeyboardInterrupt"
    finally:
        client.stop_channels()
        kernel.shutdown_kernel(now=True)

    assert eventually(lambda: marked(mark) == [], ENDS_S)


def test_a_run_without_simulators_cannot_be_shown(tmp_path):
    """The page waits for a run that is starting, but not forever."""
    with pytest.raises(ViewError, match=r"the page did not start within 0\.5 s"):
        palaestra.show(tmp_path, deadline_s=0.5)


def test_a_notebook_is_the_training_of_a_job(folder):
    """`palaestra run` needs no image: the program `jupyter` of this environment runs the file."""
    job = yaml.safe_load((folder / "6-train.yaml").read_text())
    job["spec"]["trainer"]["command"][-1] = str(folder / "6-train.ipynb")
    with running(job) as training:
        code, output = training.end()

        assert code == 0, output
        assert (training.directory / "model.zip").is_file()
    assert "512" in output


def reply_to(client, request):
    """Return the content of the reply to a request; a slow kernel has replied to earlier requests too."""
    while (message := client.get_shell_msg(timeout=ENDS_S))["parent_header"]["msg_id"] != request:
        pass
    return message["content"]


def marked(mark):
    """Return the ids of the processes whose environment has this mark, without this process."""
    found = []
    for path in Path("/proc").glob("[0-9]*/environ"):
        try:
            if mark.encode() in path.read_bytes() and int(path.parent.name) != os.getpid():
                found.append(int(path.parent.name))
        except OSError:
            continue
    return found
