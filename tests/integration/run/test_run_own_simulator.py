"""docs/howto/bring-a-simulator.md, with the simulator in examples/simulators."""

import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from xmlrpc.client import ServerProxy

import pytest
import yaml

from palaestra_trainer.ros.conformance.claims import claims
from tests.local_run import PALAESTRA
from tests.pages import blocks, fenced
from tests.terminal import Terminal
from tests.waiting import eventually

ROOT = Path(__file__).parents[3]
FOLDER = ROOT / "examples/simulators"
SIMULATOR = FOLDER / "cart_simulator.py"
JOB = yaml.safe_load((FOLDER / "cart.yaml").read_text())
PAGE = (ROOT / "docs/howto/bring-a-simulator.md").read_text()
DEADLINE_S = 240.0
WORLD = claims("training").world


@pytest.fixture
def folder(tmp_path):
    """Return a copy of the example, in which programs may write."""
    return Path(shutil.copytree(FOLDER, tmp_path / "simulators", ignore=lambda *_: ["__pycache__"]))


def test_the_job_of_the_example_learns_its_task_for_other_simulators_too(folder):
    """A reader types this command first. A policy that succeeds shows that the simulator's data is right."""
    [train], [elsewhere] = blocks(PAGE, "sh train"), blocks(PAGE, "sh elsewhere")
    terminal = Terminal(folder, path=PALAESTRA.parent)

    printed = terminal.type_in(train, DEADLINE_S)
    measured = terminal.type_in(elsewhere, DEADLINE_S)

    summary = json.loads((folder / "runs/cart/0/summary.json").read_text())
    assert (summary["steps"], summary["faults"]) == (3072, 0), printed
    assert summary["success_rate"] >= 0.8, printed
    assert re.findall(r"^(stub|mujoco) +(?:80|100)% ", measured, re.MULTILINE) == ["stub", "mujoco"], measured


def test_the_commands_of_the_page_test_the_example(folder):
    """The reader has three terminals; this test types each command as soon as the one before is ready."""
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = str(taken.getsockname()[1])
    master, simulator, test = (
        blocks(PAGE, f"sh {terminal}")[0].replace("11311", port)
        for terminal in ("master", "simulator", "test")
    )
    with ExitStack() as terminals:
        terminals.enter_context(typed(master, folder))
        eventually(lambda: found(port, "getPid"), DEADLINE_S)
        terminals.enter_context(typed(simulator, folder))
        eventually(lambda: found(port, "lookupService", "/cart/robot/get_device_list"), DEADLINE_S)
        printed = Terminal(folder, path=PALAESTRA.parent).type_in(test, DEADLINE_S)

    assert printed in blocks(PAGE, "text")
    assert "31 of 31 claims hold" in (folder / "report.md").read_text()


@contextmanager
def typed(text, folder):
    """Run commands in a shell of their own until the end of the block."""
    path = f"{PALAESTRA.parent}:{os.environ['PATH']}"
    words = ["bash", "-euc", text]
    with subprocess.Popen(
        words, cwd=folder, env={**os.environ, "PATH": path}, start_new_session=True
    ) as shell:
        try:
            yield
        finally:
            with suppress(ProcessLookupError):
                os.killpg(shell.pid, signal.SIGKILL)


def found(port, method, *names):
    """Return whether a master responds to a method with success."""
    with suppress(OSError), ServerProxy(f"http://127.0.0.1:{port}") as master:
        code, _, _ = getattr(master, method)("/test", *names)
        return code == 1
    return False


def test_the_tables_of_the_page_have_the_services_and_topics_of_the_claims():
    """A reader implements these rows, so the program that tests the simulator must test the same."""
    rows = re.findall(r"^\| (`[\w/`, ]+`) \| `([\w/]+)` \|", PAGE, re.MULTILINE)
    listed = {(path, kind) for paths, kind in rows for path in re.findall(r"[\w/]+", paths)}
    asked = claims("training")
    services = {(path, kind.removeprefix("webots_ros/")) for _, path, kind, _ in (*asked.calls, *asked.last)}

    assert listed == services | set(asked.topics.items())
    assert f"calls {len(services)} services" in PAGE


@pytest.mark.parametrize("block", blocks(PAGE, "python from-the-example"))
def test_a_block_of_the_page_is_a_part_of_the_example(block):
    """A reader compares the page with the file."""
    assert block in SIMULATOR.read_text()


def test_the_page_names_the_options_of_the_job_and_prints_a_problem_as_the_program_does():
    """Both are examples that a reader copies or searches for."""
    [group] = [group for text in blocks(PAGE, "yaml") for group in yaml.safe_load(text)["simulators"]]
    own = JOB["spec"]["simulators"][0]
    source = ROOT / "trainer/src/palaestra_trainer/ros/conformance/rehearsal.py"
    [problem] = [text for _, text in fenced(PAGE) if text.startswith("a step sends")]

    assert group == {name: own[name] for name in group}
    assert problem.rpartition("; ")[2].strip() in source.read_text()


@pytest.mark.parametrize(
    ("world", "code", "sentence"),
    [
        (None, 2, "cart.wbt: No such file or directory; name a world that can be read"),
        ("no world", 2, "cart.wbt:1:1: "),
        (WORLD.replace('"ros"', '"void"'), 2, 'not exactly one robot has controller "ros"; use the world in'),
        (WORLD, 1, "no ROS master at http://127.0.0.1:9: "),
    ],
)
def test_a_mistake_ends_the_example_with_one_sentence(tmp_path, world, code, sentence):
    """A person sees this sentence as the last line in the log of the simulator."""
    path = tmp_path / "cart.wbt"
    if world is not None:
        path.write_text(world)

    ended = subprocess.run(
        [sys.executable, SIMULATOR, path],
        env={**os.environ, "ROS_MASTER_URI": "http://127.0.0.1:9"},
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=False,
    )

    assert (ended.returncode, ended.stdout) == (code, "")
    assert sentence in ended.stderr
    assert ended.stderr.count("\n") == 1
