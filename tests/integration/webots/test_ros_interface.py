"""Every service and topic of docs/ros-interface.md, called and heard by a client with rospy."""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.integration.webots.interface_plan import ANSWERS, FIELDS, QUIT_STATUS, absolute, plan
from tools.interface.everything import FAILING, offered, world

DEADLINE_S = 120.0  # of what takes seconds, on a busy machine
CLIENT = Path(__file__).with_name("rospy_client.py")
STUB = Path(sys.executable).with_name("palaestra-stub")
SURVEY = offered()


@pytest.fixture(scope="module")
def outcome(master, tmp_path_factory):
    """Return the answers by the names of calls, the messages by topic, and the stub's exit status."""
    path = tmp_path_factory.mktemp("interface") / "everything.wbt"
    path.write_text(world())
    environment = {**os.environ, "ROS_MASTER_URI": master}
    with subprocess.Popen([STUB, path], env=environment, stderr=subprocess.DEVNULL) as stub:
        try:
            client = subprocess.run(
                [sys.executable, CLIENT],
                input=json.dumps(plan(path)),
                env=environment,
                stdout=subprocess.PIPE,
                text=True,
                timeout=DEADLINE_S,
                check=True,
            )
            found = json.loads(client.stdout)
            stub.wait(timeout=DEADLINE_S)
        finally:
            stub.kill()
    return {**found, "status": stub.returncode}


@pytest.mark.parametrize("path", sorted(SURVEY.services.keys() - {"robot/time_step"} - FAILING))
def test_a_service_of_the_page_succeeds(outcome, path):
    """And where its answer is known from what was asked before, it is that."""
    answer = outcome["answers"][path]

    assert "failed" not in answer, answer
    if path.startswith("supervisor/field/insert_"):
        assert answer == {"success": 0}, "a field of one value takes no second"
    else:
        assert answer.get("success", 1)
    expected = ANSWERS.get(path)
    if expected is not None:
        assert {name: answer[name] for name in expected} == pytest.approx(expected)


@pytest.mark.parametrize("path", sorted(FAILING))
def test_a_service_that_the_page_calls_failing_fails(outcome, path):
    """A success that did nothing would leave a client with a wrong picture."""
    answer = outcome["answers"][path]

    assert "failed" in answer or not next(iter(answer.values()))


@pytest.mark.parametrize("type_name", FIELDS)
def test_a_field_of_every_type_is_read_as_it_was_written(outcome, type_name):
    """Through the messages of rospy and back."""
    _, _, value = FIELDS[type_name]

    assert outcome["answers"][f"supervisor/field/get_{type_name}"]["value"] == pytest.approx(value)


@pytest.mark.parametrize("path", sorted(SURVEY.topics))
def test_a_topic_of_the_page_is_heard(outcome, path):
    """In the class of its type, with the time at which it was sent."""
    message = outcome["heard"][absolute(path)]

    assert message.get("header", {"stamp": 1.0})["stamp"] > 0.0


def test_the_last_service_ends_the_simulator_with_the_status_that_was_asked_for(outcome):
    """After reset, restart, revert, reload and load, each of which the client came back from."""
    assert outcome["answers"]["supervisor/simulation_quit"]["success"]
    assert outcome["status"] == QUIT_STATUS
