"""Every service and topic of the controller for Webots, beside the claims and beside the stub."""

import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest

from palaestra_trainer.cli.conformance import main
from palaestra_trainer.ros import is_served
from palaestra_trainer.ros.conformance.claims import FAILED, claims, verdicts
from palaestra_trainer.ros.conformance.player import Player
from palaestra_trainer.ros.conformance.rehearsal import CLAIMS, rehearsed
from palaestra_trainer.ros.conformance.wire_client import WireClient
from tests.waiting import eventually
from tools.interface.everything import ROBOT

DEADLINE_S = 60.0
STUB = Path(sys.executable).with_name("palaestra-stub")
UNLIKE = {"supervisor/animation_stop_recording"}  # the stub records no animations
# Each simulator has handles of its own.
HANDLES = ("supervisor/get_", "supervisor/node/get_field", "supervisor/node/get_parent", "field/get_node")


@pytest.fixture
def played(tmp_path):
    """Return a function that makes the calls of some claims in the folder of the world."""

    def play(asked, *, ending):
        with closing(WireClient()) as client:
            return Player(client, ROBOT, asked.step_ms, str(tmp_path / "worlds")).play(asked, ending=ending)

    return play


def write_files(folder):
    """Write the files of the claims, as a person does with --world."""
    assert main(["--world", "--files", str(folder)]) == 0


@pytest.mark.parametrize("release", ["R2023b", "R2025a"])
def test_every_claim_about_webots_holds(webots, played, tmp_path, release):
    """The page of the interface makes these claims for Webots' own controller and for ours."""
    asked = claims("webots")
    webots(asked.world, ROBOT, release=release, FAKE_WEBOTS_PHYSICS="mujoco")
    write_files(tmp_path / "worlds")

    answers, heard = played(asked, ending=True)

    assert [it for it in verdicts(asked, answers, heard) if it.problem] == []


def test_a_training_can_drive_a_robot_in_webots(webots):
    """The claims of a training are also about time, steps and resets, which single calls cannot show."""
    asked = claims("training")
    webots(asked.world, asked.robot, FAKE_WEBOTS_PHYSICS="mujoco")

    with closing(WireClient()) as client:
        found = rehearsed(client, asked, asked.robot)

    assert {it.path: it.problem for it in found} == dict.fromkeys(CLAIMS, "")


def test_each_service_responds_as_in_the_stub(webots, played, client, tmp_path):
    """The tests' Webots simulates with the stub. A difference is a wrong function or order of arguments."""
    asked = claims("stub")
    webots(asked.world, ROBOT, FAKE_WEBOTS_PRESSED="1")
    ours, _ = played(asked, ending=False)
    client.call(f"/{ROBOT}/supervisor/simulation_quit", "webots_ros/set_int", {"value": 0})
    # A controller registers and unregisters this service last, and the stub uses the same names.
    eventually(lambda: not is_served(f"/{ROBOT}/robot/get_device_list"), DEADLINE_S)
    with subprocess.Popen([STUB, tmp_path / "worlds" / "world.wbt"], stderr=subprocess.DEVNULL) as process:
        eventually(lambda: is_served(f"/{ROBOT}/robot/get_device_list"), DEADLINE_S)
        wanted, _ = played(asked, ending=False)
        process.terminate()

    compared = {
        name: (ours[name], wanted[name])
        for name, path, *_ in asked.calls
        if not {path, path.replace("get_sampling_period", "enable")} & (asked.fails | UNLIKE)
        and "palaestra/" not in path
        and not any(it in path for it in HANDLES)
    }
    assert len(compared) > 300
    assert {name: pair for name, pair in compared.items() if not _alike(*pair)} == {}


def _alike(ours, wanted):
    """Return whether two responses are equal, except for the time at which they were made."""
    return {**ours, "header": 0, FAILED: 0} == {**wanted, "header": 0, FAILED: 0}
