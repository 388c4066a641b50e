"""A simulator behaves in the same way in each place in which a facade can start it."""

import os
import signal
import subprocess
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path

import pytest

from palaestra_sim.world import builtin
from palaestra_trainer.errors import ConfigurationError, SimulatorDead
from palaestra_trainer.webots import Docker, ThisMachine, Webots
from tests.docker_engine import Engine
from tests.local_run import below
from tests.pages import blocks
from tests.waiting import eventually

PATIENCE_S = 60.0
STUB = f"palaestra-stub:{version('palaestra-trainer')}"
OWNER = """
import sys
from palaestra_trainer.webots import Webots
webots = Webots({name!r}, {world!r}, launcher={launcher!r})
webots.start()
print("started", flush=True)
sys.stdin.read()
"""


@pytest.fixture(scope="module")
def engine(master):
    """Yield a Docker Engine with the image of the stub; DOCKER_HOST names it."""
    del master
    with tempfile.TemporaryDirectory() as folder:  # pytest's folders may be too long for a Unix socket
        server = Engine(Path(folder))
        server.images.add(STUB)
        os.environ["DOCKER_HOST"] = server.host
        yield server
        del os.environ["DOCKER_HOST"]
        server.close()


@pytest.fixture(params=["process", "docker"])
def place(request, engine):
    """Return the name of a place, for Webots(launcher=...)."""
    del engine
    return request.param


def simulators():
    """Return the process ids of the stubs that this process or one of its containers started."""
    processes = below(os.getpid())
    return [pid for pid, words in processes if any(word.endswith("/palaestra-stub") for word in words[:2])]


def test_a_simulator_starts_steps_stops_and_starts_again(make, place, engine):
    """A notebook uses the same three calls in every place, and closing leaves nothing."""
    webots = make(launcher=place)

    first = webots.run(webots.observer.time)
    webots.stop()
    stopped = webots.available()
    webots.start()
    webots.close()

    assert first >= 0
    assert not stopped
    assert simulators() == []
    assert engine.running() == []


def test_a_simulator_that_was_killed_is_restarted(make, place):
    """The sidecar outlives its simulator in every place, so the facade can start the simulator again."""
    webots = make(launcher=place)
    with webots:
        (pid,) = simulators()
        os.kill(pid, signal.SIGKILL)
        with pytest.raises(SimulatorDead):
            eventually(lambda: webots.observer.time() < 0, PATIENCE_S)
        webots()

    assert webots.available()


def test_two_simulators_of_one_world_have_names_of_their_own(make, name, place):
    """The second facade chooses the next free name, also if both are in containers."""
    assert [make(launcher=place).robot_name for _ in range(2)] == [name, f"{name}_2"]


def test_places_may_be_mixed(make, name):
    """A simulator in a container and one on this machine share the ROS master, so they need two names."""
    first, second = make(launcher="docker"), make(launcher=ThisMachine())
    with first, second:
        assert first.observer.time() >= 0
        assert second.observer.time() >= 0

    assert (first.robot_name, second.robot_name) == (name, f"{name}_2")


def test_a_wrong_world_is_refused_with_the_line_of_the_sidecar(place, tmp_path, engine):
    """The mistake is the user's, so an error must come at once, and no process or container may stay."""
    wrong = tmp_path / "wrong.wbt"
    wrong.write_text("#VRML_SIM R2023b utf8\nRobot {")

    with pytest.raises(ConfigurationError, match=r"palaestra-sidecar: .*wrong\.wbt"):
        Webots("robotino", wrong, launcher=place)
    with pytest.raises(ConfigurationError, match=r"/no\.wbt: No such file"):
        Webots("robotino", "/no.wbt", launcher=place)

    assert engine.running() == []


def test_a_killed_program_leaves_no_simulator(place, name, world, engine):
    """A notebook's kernel may be killed; then its simulator ends in every place."""
    script = OWNER.format(name=name, world=str(world), launcher=place)
    owner = subprocess.Popen(
        [sys.executable, "-c", script], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    assert owner.stdout.readline() == "started\n"
    assert len(simulators()) == 1

    owner.kill()
    owner.communicate()

    assert eventually(lambda: simulators() == [] and engine.running() == [], PATIENCE_S)


def test_the_container_has_what_the_settings_say(make, engine, world):
    """Docker has other names for the settings. The container has no capability and a read-only world."""
    make(launcher=Docker(shm_size="1g", gpus=2)).start()
    request = next(engine.created[name].request for name in engine.running())

    host = request["HostConfig"]
    assert request["Image"] == STUB
    assert (request["OpenStdin"], request["StdinOnce"]) == (True, True)
    assert (host["NetworkMode"], host["AutoRemove"], host["ShmSize"]) == ("host", True, 1 << 30)
    assert host["DeviceRequests"][0]["Count"] == 2
    assert host["DeviceRequests"][0]["Capabilities"] == [["gpu"]]
    assert host["CapDrop"] == ["ALL"]
    assert host["SecurityOpt"] == ["no-new-privileges"]
    assert [(each["Source"], each["ReadOnly"]) for each in host["Mounts"]] == [(str(world.parent), True)]


def test_the_block_of_the_page_runs(engine, capsys, monkeypatch):
    """A reader copies the block, and replaces only the name of the image."""
    page = (Path(__file__).parents[3] / "docs/howto/where-simulators-run.md").read_text()
    monkeypatch.setattr(engine, "images", {STUB.replace("stub", "mujoco"), "lab/simulators:2"})
    (block,) = blocks(page, "python with-docker")

    exec(compile(block, "where-simulators-run.md", "exec"), {})

    assert capsys.readouterr().out == "0.0\n"
    assert engine.running() == []


def test_a_path_may_be_relative(make, place, world, monkeypatch):
    """A container has another working folder; a folder with the name of a shipped world changes nothing."""
    monkeypatch.chdir(world.parent)
    (world.parent / "court").mkdir()

    Webots("burger", "court", launcher="docker").close()
    assert make(launcher=place, world=Path(world.name)).robot_name.startswith("rover_")


def test_a_project_of_webots_is_mounted_whole(engine, tmp_path, name):
    """A world in the folder `worlds` uses files of the folder above it."""
    path = tmp_path / "project" / "worlds" / "arena.wbt"
    path.parent.mkdir(parents=True)
    path.write_bytes(builtin("arena").replace(b"--name=robotino", f"--name={name}".encode()))

    webots = Webots(name, path, launcher="docker")
    request = next(engine.created[each].request for each in engine.running())
    webots.close()

    assert [each["Source"] for each in request["HostConfig"]["Mounts"]] == [str(tmp_path / "project")]


@pytest.mark.parametrize(
    ("settings", "driver", "line"),
    [
        ({"image": "no:1"}, "stub", "no:1: No such image: no:1; build or load it first"),
        ({}, "webots", r"no image for driver webots; give Docker\(image=...\)"),
        ({"network": "lab"}, "stub", "network lab not found"),
        ({"network": "far"}, "stub", "network far has driver overlay and 1 gateways; use a network with"),
        ({"network": "own"}, "stub", "a container in network own cannot reach the ROS master at http://127"),
        ({"image": "busy:1"}, "stub", "busy:1: could not select device driver .* NVIDIA Container Toolkit"),
    ],
)
def test_each_refusal_names_the_remedy(engine, settings, driver, line, monkeypatch):
    """The user reads one line, and no container is left."""
    monkeypatch.setattr(engine, "images", {STUB, "busy:1"})
    monkeypatch.setattr(
        engine,
        "networks",
        {
            name: {"Name": name, "Driver": kind, "IPAM": {"Config": [{"Gateway": "198.18.0.1"}]}}
            for name, kind in (("far", "overlay"), ("own", "bridge"))
        },
    )
    if settings.get("image") == "busy:1":
        monkeypatch.setattr(engine, "refusal", 'could not select device driver "" with capabilities: [[gpu]]')

    with pytest.raises(ConfigurationError, match=line):
        Webots("robotino", "arena", launcher=Docker(**settings), driver=driver)

    assert engine.running() == []


def test_a_rootless_engine_has_another_network(engine, monkeypatch):
    """Its network `host` is a namespace of its own, where this program's ROS master is not reachable."""
    monkeypatch.setattr(engine, "security_options", ["name=seccomp,profile=builtin", "name=rootless"])

    with pytest.raises(ConfigurationError, match="of a rootless engine is not the network of this machine"):
        Webots("robotino", "arena", launcher="docker")


def test_without_an_engine_the_line_names_its_address():
    """No engine runs, or DOCKER_HOST is wrong. The SDK leaves a socket open, so the test starts a process."""
    told = subprocess.run(
        [
            sys.executable,
            "-c",
            'import palaestra_trainer.webots as w; w.Webots("r", "arena", launcher="docker")',
        ],
        env={**os.environ, "DOCKER_HOST": "unix:///nowhere/docker.sock"},
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
    )

    last = told.stderr.strip().splitlines()[-1]
    assert (
        "ConfigurationError: launcher docker: no Docker Engine responds at unix:///nowhere/docker.sock"
        in last
    )
    assert "No such file or directory" in last
    assert "; start it, set DOCKER_HOST, or give this user" in last


def test_a_launcher_that_is_not_known_is_refused():
    """A typing error must not start another simulator."""
    with pytest.raises(ConfigurationError, match='"dokcer" is not a launcher; choose one of "process"'):
        Webots("robotino", "arena", launcher="dokcer")
