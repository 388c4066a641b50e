"""Jobs with driver webots: the sidecar gives Webots the controller, and the policy learns from its robots."""

import os

import pytest

from tests.local_run import LocalRun
from tests.soak.jobs import LITTLE_DQN, tiny_job

# A world of a stranger: three robots of Webots' library, without any argument of the controller.
FOOTBALL = """#VRML_SIM R2023b utf8
EXTERNPROTO "https://raw.githubusercontent.com/cyberbotics/webots/R2023b/projects/robots/festo/robotino3/protos/Robotino3.proto"
EXTERNPROTO "https://raw.githubusercontent.com/cyberbotics/webots/R2023b/projects/objects/floors/protos/Floor.proto"
WorldInfo { basicTimeStep 32 }
Viewpoint { }
Floor { size 10 10 }
DEF TARGET Pose { translation 1 0 0.001 }
DEF KEEPER Robotino3 { translation 0 2 0 name "keeper" controller "ros" }
DEF ROBOTINO Robotino3 { name "striker" controller "ros" }
DEF BACK Robotino3 { translation 0 -2 0 name "back" controller "ros" }
DEF REFEREE Robot { name "referee" controller "ros" supervisor TRUE }
"""


@pytest.fixture
def newest_webots(homes, monkeypatch):
    """Make the newest release the Webots of this machine."""
    home = homes["R2025a"]
    monkeypatch.setenv("WEBOTS_HOME", str(home))
    monkeypatch.setenv("PATH", f"{home}:{os.environ['PATH']}")
    monkeypatch.delenv("WEBOTS_EXTRA_PROJECT_PATH", raising=False)


@pytest.mark.usefixtures("newest_webots")
@pytest.mark.parametrize("driver", ["stub", "mujoco", "webots"])
def test_one_of_three_robots_of_a_stranger_is_trained(tmp_path, driver):
    """One world file must work in all simulators. All its robots step together, and one of them learns."""
    world = tmp_path / "football" / "worlds" / "football.wbt"
    world.parent.mkdir(parents=True)
    world.write_text(FOOTBALL)
    # A reload ends the controllers of all robots, and starts them again.
    where = {"driver": driver, "world": {"file": str(world)}, "reset": "Reload"}
    evaluation = {"everySteps": 0}
    job = tiny_job(collect=where, steps=100, evaluation=evaluation, algorithm=LITTLE_DQN)

    with LocalRun(tmp_path, job) as run:
        code, output = run.end()

    assert code == 0, output
    assert "faults            0" in output
    assert run.summary()["goodput"]["recycling"] > 0.0
