"""The page about real robots: its commands drive the mock robot, typed as a reader types them."""

import os
import pty
import re
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from palaestra_trainer.cli.deploy import DEPLOY, arguments_parser
from tests.mock_robots import DEADLINE_S, Client
from tests.packages import write_package
from tests.pages import blocks

PAGE = (Path(__file__).parents[3] / "docs/howto/real-robot.md").read_text()
PROGRAMS = Path(sys.executable).parent


@pytest.fixture
def shell(tmp_path):
    """Yield a function that runs commands in a shell of their own, until the end of the test."""
    shells = []

    def run(typed_in, **streams):
        path = f"{PROGRAMS}:{os.environ['PATH']}"
        words = ["bash", "-euc", typed_in]
        environment = {**os.environ, "PATH": path}
        one = subprocess.Popen(words, cwd=tmp_path, env=environment, start_new_session=True, **streams)
        shells.append(one)
        return one

    yield run
    for one in shells:
        with suppress(ProcessLookupError):
            os.killpg(one.pid, signal.SIGKILL)
        one.wait()
        if one.stdout is not None:
            one.stdout.close()


def test_the_commands_of_the_page_drive_the_mock_robot(shell, tmp_path):
    """A reader types in two terminals and holds the space bar. The test's package needs no training."""
    [robot], [deploy] = blocks(PAGE, "sh robot"), blocks(PAGE, "sh deploy")
    write_package(tmp_path / "runs/move-to-target/0/package")
    serving = shell(robot.strip() + " --listen 127.0.0.1:0", stdout=subprocess.PIPE, text=True)
    address = serving.stdout.readline().strip()
    leader, follower = pty.openpty()
    program = shell(
        deploy.replace("http://127.0.0.1:8080", address), stdin=follower, stdout=follower, stderr=follower
    )
    os.close(follower)

    shown = typed(leader, program)

    assert program.wait(DEADLINE_S) == 0, shown
    assert shown.count("reached after") == 2
    client = Client(address)
    assert client.get("/mock/truth")["vx"] == 0.0
    client.connection.close()


def typed(leader, program):
    """Answer yes, then hold the space bar until the program ends; return the output of the terminal."""
    shown, ends = "", time.monotonic() + DEADLINE_S
    os.set_blocking(leader, False)
    while program.poll() is None and time.monotonic() < ends:
        with suppress(BlockingIOError, OSError):
            shown += os.read(leader, 65_536).decode(errors="replace")
        if "hold the space bar" in shown:
            with suppress(OSError):
                os.write(leader, b" ")
        elif "Type yes:" in shown and "yes\r" not in shown:
            os.write(leader, b"yes\n")
        time.sleep(0.02)  # a terminal repeats a held key 30 to 50 times a second
    os.close(leader)
    return shown


def test_the_page_has_every_option_of_the_program():
    """Readers use only the options that the page explains."""
    explained = set(re.findall(r"`(--[a-z-]+)", PAGE))
    options = {name for action in arguments_parser()._actions for name in action.option_strings}

    assert {name for name in options if name.startswith("--")} - {"--help"} <= explained


def test_the_help_leads_to_the_page():
    """The help is where a person looks first."""
    assert "docs/howto/real-robot.md" in DEPLOY
