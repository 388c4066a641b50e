"""The controller for Webots, started by a Webots of the tests."""

import os
import subprocess
import uuid
from contextlib import ExitStack

import pytest

from palaestra_sim.webots_project import extra_projects, write_project
from palaestra_trainer.ros import is_served
from palaestra_trainer.ros.conformance.wire_client import WireClient
from tests.fake_webots.home import RELEASES, make_home
from tests.waiting import eventually

DEADLINE_S = 60.0


@pytest.fixture(scope="session")
def homes(tmp_path_factory):
    """Return WEBOTS_HOME of each release."""
    folder = tmp_path_factory.mktemp("webots")
    return {release: make_home(folder, release) for release in RELEASES}


@pytest.fixture(scope="session")
def controllers(tmp_path_factory):
    """Return the folder of a project with the controller."""
    folder = tmp_path_factory.mktemp("controllers")
    write_project(folder)
    return folder


@pytest.fixture
def prefix():
    """Return the beginning of ROS names that only this test uses, because all tests share a master."""
    return f"w{uuid.uuid4().hex[:8]}"


@pytest.fixture
def webots(master, homes, controllers, tmp_path):
    """Yield a function that starts Webots with a world and waits for robots; all end with the test."""
    del master
    with ExitStack() as started:

        def start(text, *robots, release="R2025a", mode="fast", **environment):
            world = tmp_path / "worlds" / "world.wbt"
            world.parent.mkdir(exist_ok=True)
            world.write_text(text)
            home = homes[release]
            process = subprocess.Popen(
                [home / "webots", "--batch", f"--mode={mode}", "--stdout", "--stderr", world],
                env={
                    **os.environ,
                    **extra_projects(controllers, {}),
                    "WEBOTS_HOME": str(home),
                    **environment,
                },
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                text=True,
            )
            started.callback(_end, process)
            for robot in robots:
                eventually(lambda robot=robot: is_served(f"/{robot}/robot/get_device_list"), DEADLINE_S)
            return process

        yield start


@pytest.fixture
def client():
    """Yield a client of services and topics."""
    it = WireClient()
    yield it
    it.close()


def _end(process):
    """End Webots. If it does not end in time, this test fails and kills it.

    Otherwise the next test would fail too, because its robots have the same ROS names.
    """
    process.terminate()
    try:
        process.communicate(timeout=DEADLINE_S)
    finally:
        process.kill()
