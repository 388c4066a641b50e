"""Clients with rospy and roscpp can use every service and topic in docs/reference/ros-interface.md."""

import json
import os
import re
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from palaestra_sim.scene.png import encode
from palaestra_trainer.ros.conformance.claims import claims
from tests.integration.webots.playing import play
from tests.integration.webots.roscpp_build import build
from tests.integration.webots.roscpp_client import RoscppClient
from tests.tables import for_each
from tools.interface.everything import FAILING, offered, world
from tools.interface.plan import ANSWERS, FIELDS, QUIT_STATUS

DEADLINE_S = 120.0  # the client needs only seconds on an idle machine
ROOT = Path(__file__).parents[3]
RUN = "import sys; from palaestra_sim.{}.cli import main; sys.exit(main())"
PAGE = (ROOT / "docs/reference/ros-interface.md").read_text()
STEPPED = {"robot/time_step"}


def cases(paths):
    """Return a function that returns pairs: each simulator with each path in `paths(simulator)`."""
    return lambda: [(simulator, path) for simulator in FAILING for path in sorted(paths(simulator))]


def of_rospy(simulator, environment, folder):
    """Return the results of the client with rospy, which runs in a separate process."""
    client = subprocess.run(
        [sys.executable, "-m", "tests.integration.webots.rospy_client", simulator, folder],
        cwd=ROOT,
        env=environment,
        stdout=subprocess.PIPE,
        text=True,
        timeout=DEADLINE_S,
        check=True,
    )
    return json.loads(client.stdout)


def of_roscpp(simulator, environment, folder):
    """Return the results of the client with roscpp, and the md5 sums of its types."""
    with RoscppClient(program(folder.parent / "roscpp"), environment, folder / "errors.log") as client:
        return {**play(claims(simulator), client, str(folder)), "digests": client.digests}


@cache
def program(folder):
    """Return the path of the client with roscpp, built once for all simulators."""
    folder.mkdir()
    survey = offered("mujoco")  # MuJoCo has all types that the stub has
    return build(folder, set(survey.services.values()), set(survey.topics.values()))


@pytest.fixture(scope="module", params=[of_rospy, of_roscpp], ids=["rospy", "roscpp"])
def outcomes(request, master, tmp_path_factory):
    """Return a function that runs a client with a simulator and returns the results.

    The results are the responses by call, the messages by topic, and the simulator's exit status.
    """

    @cache
    def outcomes(simulator):
        folder = tmp_path_factory.mktemp(simulator)
        environment = {**os.environ, "ROS_MASTER_URI": master, "ROS_HOME": str(folder)}
        return observed(simulator, request.param, environment, folder)

    return outcomes


def observed(simulator, client, environment, folder):
    """Run a simulator and a client, and return the client's results and the simulator's exit status."""
    path = folder / "everything.wbt"
    path.write_text(world())
    (folder / "logo.png").write_bytes(encode((1, 1), b"\0\0\xff\xff"))
    command = [sys.executable, "-c", RUN.format(simulator), path]
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as running:
        try:
            found = client(simulator, environment, folder)
            running.wait(timeout=DEADLINE_S)
        finally:
            running.kill()
    return {**found, "status": running.returncode}


def near(value):
    """Return a response for comparison, in which every number may differ by rounding."""
    if isinstance(value, dict):
        return {name: near(inside) for name, inside in value.items()}
    if isinstance(value, list):
        return [near(inside) for inside in value]
    return pytest.approx(value)


@pytest.mark.parametrize("outcomes", [of_roscpp], ids=["roscpp"], indirect=True)
def test_the_headers_of_roscpp_have_the_md5_of_the_page(outcomes):
    """A client refuses a type with another md5 sum, which gencpp computes from the definition."""
    rows = dict(re.findall(r"^\| `[^`]+` \| (\S+) \| `(\w{32})` ", PAGE, re.MULTILINE))

    assert outcomes("stub")["digests"] == rows


@for_each("simulator, path", cases(lambda it: offered(it).services.keys() - STEPPED - FAILING[it]))
def test_a_service_of_the_page_succeeds(outcomes, simulator, path):
    """A user relies on the page. If earlier requests determine the response, the test compares its values."""
    answer = outcomes(simulator)["answers"][path]

    assert "failed" not in answer, answer
    if path.startswith("supervisor/field/insert_"):
        assert answer == {"success": 0}, "a field of one value takes no second"
    else:
        assert answer.get("success", 1)
    expected = ANSWERS.get(path)
    if expected is not None:
        assert {name: answer[name] for name in expected} == near(expected)


@for_each("simulator, path", cases(FAILING.__getitem__))
def test_a_service_that_the_page_calls_failing_fails(outcomes, simulator, path):
    """If such a service reported success, a client would rely on an effect that it does not have."""
    answer = outcomes(simulator)["answers"][path]

    assert "failed" in answer or not next(iter(answer.values()))


@for_each("simulator, type_name", [(simulator, name) for simulator in FAILING for name in FIELDS])
def test_a_field_of_every_type_is_read_as_it_was_written(outcomes, simulator, type_name):
    """The value passes through the client's messages in both directions."""
    _, _, value = FIELDS[type_name]

    answers = outcomes(simulator)["answers"]
    assert answers[f"supervisor/field/get_{type_name}"]["value"] == pytest.approx(value)


@for_each("simulator, path", cases(lambda it: offered(it).topics))
def test_a_topic_of_the_page_is_heard(outcomes, simulator, path):
    """The client can decode the message, and its stamp is the time of the measurement."""
    message = outcomes(simulator)["heard"][path]

    assert message.get("header", {"stamp": 1.0})["stamp"] > 0.0


@pytest.mark.parametrize("outcomes", [of_rospy], ids=["rospy"], indirect=True)
@pytest.mark.parametrize(
    ("topic", "encoding"), [("camera/image", "bgra8"), ("range_finder/range_image", "32FC1")]
)
def test_a_picture_arrives_whole(outcomes, topic, encoding):
    """The image has four bytes for each of 64 x 64 pixels, in an encoding that cv_bridge supports."""
    image = outcomes("mujoco")["heard"][topic]

    assert (image["width"], image["height"], image["encoding"]) == (64, 64, encoding)
    assert image["height"] * image["step"] == len(image["data"]) == 4 * 64 * 64


@pytest.mark.parametrize("simulator", FAILING)
def test_the_last_service_ends_the_simulator_with_the_status_that_was_asked_for(outcomes, simulator):
    """A request to quit must also work after the client has used reset, restart, revert, reload and load."""
    outcome = outcomes(simulator)

    assert outcome["answers"]["supervisor/simulation_quit"]["success"]
    assert outcome["status"] == QUIT_STATUS
