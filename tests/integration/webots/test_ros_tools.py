"""The blocks of docs/howto/ros-tools.md for ROS's tools and rospy work, with a stub and a real master."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from palaestra_protocol.ros.definitions import type_names
from palaestra_protocol.ros.rostypes import message_type, service_type
from tests.pages import blocks

ROOT = Path(__file__).parents[3]
PAGE = (ROOT / "docs/howto/ros-tools.md").read_text()
DEADLINE_S = 60.0  # the commands take moments on an idle machine
PRINT_MD5 = """
import webots_ros.msg, webots_ros.srv
for type_ in (*vars(webots_ros.msg).values(), *vars(webots_ros.srv).values()):
    if hasattr(type_, "_md5sum"):
        print(type_._type, type_._md5sum)
"""


@pytest.fixture
def environment(master, tmp_path):
    """Return the environment of a user's terminal.

    It has no path of ROS packages, and a folder of the test for ROS's logs.
    """
    leading = ("PYTHONPATH", "ROS_PACKAGE_PATH")
    given = {name: value for name, value in os.environ.items() if name not in leading}
    return {**given, "ROS_MASTER_URI": master, "ROS_HOME": str(tmp_path)}


@pytest.fixture
def terminal(environment):
    """Yield a function that runs blocks of the page, selected by kind, in a shell in the checkout."""
    started = []

    def typed(*kinds, **variables):
        shell = subprocess.Popen(
            ["bash", "-ec", typed_lines(*kinds)],
            cwd=ROOT,
            env={**environment, **variables},
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        started.append(shell)
        return shell

    yield typed
    for shell in started:
        if shell.poll() is None:
            os.killpg(shell.pid, signal.SIGTERM)
        shell.communicate(timeout=DEADLINE_S)


def typed_lines(*kinds):
    """Return all blocks of these kinds, in order, as one script."""
    return "".join(text for kind in kinds for text in blocks(PAGE, f"sh {kind}"))


def answer(shell):
    """Wait for the end of a shell, which must succeed without errors, and return its output."""
    output, errors = shell.communicate(timeout=DEADLINE_S)
    assert (shell.returncode, errors) == (0, "")
    return output


def run_python(code, environment):
    """Run code with the Python of the virtual environment, and return the output."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=environment["ROS_HOME"],
        env=environment,
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=True,
    )
    return done.stdout


@pytest.fixture
def simulator(terminal):
    """Start the page's simulator, wait until it responds, and return its shell."""
    shell = terminal("the-simulator")
    assert "arena.wbt: robotino" in shell.stderr.readline()
    return shell


@pytest.mark.usefixtures("simulator")
@pytest.mark.parametrize("place", ["ros-package-path", "ros-package-path-elsewhere"])
def test_rossrv_and_rosservice_read_the_types_of_a_simulator(place, terminal, tmp_path):
    """Without the package webots_ros, these tools end with `Unable to load type`."""
    programs = f"{Path(sys.executable).parent}:{os.environ['PATH']}"

    output = answer(terminal(place, "the-tools", HOME=str(tmp_path), PATH=programs))

    assert output.split("\n\n") == ["int32 value\n---\nbool success", "value: 0.0\nsuccess: True\n"]


@pytest.mark.usefixtures("simulator")
def test_rostopic_echo_prints_a_message_of_a_simulator(terminal):
    """The simulator is stepped until rostopic ends, because no output shows when rostopic has subscribed."""
    answer(terminal("ros-package-path", "the-tools"))
    listening = terminal("ros-package-path", "the-topic")

    while listening.poll() is None:
        answer(terminal("ros-package-path", "a-step"))

    assert 'frame_id: "robotino/touch_sensor"\ndata: False\n---\n' in answer(listening)


@pytest.mark.usefixtures("simulator")
def test_rospy_calls_a_simulator_with_the_classes_of_the_package(environment):
    """A user's program with rospy needs no facade and no environment variable."""
    [program] = blocks(PAGE, "python with-rospy")

    assert run_python(program, environment) == "0.0\n"


def test_every_class_of_the_package_has_the_md5_of_the_wire(environment):
    """`make setup` must update the classes in the virtual environment after a changed definition."""
    messages, services = type_names()
    of_the_wire = {name: message_type(name).md5 for name in messages if name.startswith("webots_ros/")}
    of_the_wire |= {name: service_type(name).md5 for name in services if name.startswith("webots_ros/")}

    printed = run_python(PRINT_MD5, environment)

    of_the_classes = dict(line.split() for line in printed.splitlines())
    assert {name: of_the_classes.get(name) for name in of_the_wire} == of_the_wire


def test_the_packages_that_the_page_names_are_those_that_the_tests_run_with():
    """A reader installs the page's packages, and the tests run only with those of `make test`."""
    lines = [text for text in blocks(PAGE, "console") if "apt-get install" in text]
    installed = (ROOT / "tools/test-packages.sh").read_text()

    assert lines
    assert [name for line in lines for name in line.split()[3:] if name not in installed] == []


def test_an_installed_package_comes_before_ours(tmp_path):
    """A user's Webots may have another release than our definitions, so its package must come first."""
    installed = tmp_path / "webots_ros"
    (installed / "srv").mkdir(parents=True)
    (installed / "package.xml").write_text("<package><name>webots_ros</name></package>")
    (installed / "srv/set_int.srv").write_text("int64 other\n---\n")
    first_tool = typed_lines("the-tools").splitlines()[0]

    output = subprocess.run(
        ["bash", "-ec", f"{typed_lines('ros-package-path')}{first_tool}"],
        cwd=ROOT,
        env={**os.environ, "ROS_PACKAGE_PATH": str(tmp_path)},
        capture_output=True,
        text=True,
        timeout=DEADLINE_S,
        check=True,
    ).stdout

    assert output == "int64 other\n---\n\n"
