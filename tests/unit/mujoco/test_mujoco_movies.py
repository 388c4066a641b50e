"""The tests read a supervisor's movies with the library that also writes them."""

import errno
import math
import shutil
import subprocess
import sys
from fractions import Fraction

import av
import numpy as np
import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.movies import Movie, frame_step_ms
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.tree.fields import FieldType
from palaestra_sim.stub.physics import StubPhysics
from tests.failing import failing

SIZE = (64, 48)
BLUE, GREEN, RED = range(3)
WHEEL = """HingeJoint { jointParameters HingeJointParameters { axis 0 1 0 anchor 0 %s 0.05 }
  device RotationalMotor { name "%s" maxVelocity 50 }
  endPoint Solid { translation 0 %s 0.05 rotation 1 0 0 1.5707963
    boundingObject Cylinder { radius 0.05 height 0.01 } } }"""
# A red robot drives to the right; the viewpoint looks down on it.
WORLD = f"""#VRML_SIM R2023b utf8
WorldInfo {{ basicTimeStep 20 }}
Viewpoint {{ position 0 0 3 orientation -0.577 0.577 0.577 2.0944 }}
Robot {{ children [ {WHEEL % ("0.1", "left", "0.1")} {WHEEL % ("-0.1", "right", "-0.1")}
  Shape {{ appearance PBRAppearance {{ baseColor 1 0 0 }} geometry Box {{ size 0.4 0.4 0.1 }} }} ] }}
"""


@pytest.fixture
def simulation():
    """Return a simulation whose robot drives at 0.5 m/s."""
    simulation = Simulation.load(WORLD.encode(), MujocoPhysics(), "world", Mode.FAST)
    for motor in simulation.robots[0].motors.values():
        motor.set_position(math.inf)
        motor.set_velocity(10.0)
    return simulation


def movie(path, **changes):
    """Return a movie of the best quality."""
    return Movie(**{"path": str(path), "size": SIZE, "quality": 100, "acceleration": 1, **changes})


def frames(path):
    """Return the frames of a movie file, each (height, width, 3), and its frame rate."""
    with av.open(str(path)) as file:
        rate = file.streams.video[0].average_rate
        return [frame.to_ndarray(format="bgr24") for frame in file.decode(video=0)], rate


def place(picture):
    """Return the mean row and the mean column of the red pixels of a frame."""
    red, others = picture[:, :, RED].astype(int), picture[:, :, [BLUE, GREEN]].max(axis=2)
    return np.argwhere(red > 60 + others).mean(axis=0)


def test_a_movie_shows_the_robot_drive_in_the_time_of_the_simulation(simulation, tmp_path):
    """At 25 frames a second, the movie must be as long as the drive.

    Its file gets its name only when the movie is complete.
    """
    path = tmp_path / "drive.mp4"
    assert simulation.movies.ready
    assert simulation.movies.start(movie(path))
    simulation.step(1000)
    assert not simulation.movies.ready
    assert not path.exists()
    simulation.movies.stop()

    pictures, rate = frames(path)
    moved = place(pictures[-1]) - place(pictures[0])
    assert (len(pictures), rate, pictures[0].shape) == (25, 25, (48, 64, 3))
    assert np.abs(moved).max() > 5.0
    assert list(tmp_path.iterdir()) == [path]
    assert (simulation.movies.ready, simulation.movies.failed) == (True, False)


def test_a_movie_follows_the_viewpoint(tmp_path):
    """The robot stands still and a client moves the viewpoint, so the robot must move in the picture."""
    simulation = Simulation.load(WORLD.encode(), MujocoPhysics(), "world", Mode.FAST)
    viewpoint = next(node for node in simulation.tree.root.nodes() if node.type_name == "Viewpoint")
    path = tmp_path / "panorama.mp4"
    simulation.movies.start(movie(path))
    simulation.step(40)
    position = simulation.tree.field_of(viewpoint, "position", simulation)
    position.set(FieldType.VEC3F, 0, (0.5, 0.0, 3.0))
    simulation.step(40)
    simulation.movies.stop()

    (first, second), _ = frames(path)

    assert np.abs(place(second) - place(first)).max() > 5.0


def test_a_movie_removes_what_a_killed_simulator_left_of_it(simulation, tmp_path):
    """The unfinished file of a killed simulator would stay for ever.

    The hidden files of other movies stay, and so do files that another simulator is writing.
    """
    path = tmp_path / "drive.mp4"
    code = f"""if True:
        import os, signal
        from palaestra_sim.mujoco.video import MujocoVideo
        from palaestra_sim.scene.movies import Movie
        names = [f"{tmp_path}/{{name}}.mp4" for name in ("drive", "drive-2")]
        films = [MujocoVideo(Movie(path=it, size={SIZE}, quality=100, acceleration=1)) for it in names]
        os.kill(os.getpid(), signal.SIGKILL)"""
    subprocess.run([sys.executable, "-c", code], check=False, timeout=60)
    other = Simulation.load(WORLD.encode(), MujocoPhysics(), "world", Mode.FAST)
    left = {*tmp_path.iterdir()}
    other.movies.start(movie(path))
    underway = {*tmp_path.iterdir()} - left

    simulation.movies.start(movie(path))
    for each in (simulation, other):
        each.step(40)
        each.movies.stop()

    assert len(left) == 2
    assert len(underway) == 1
    assert {*tmp_path.iterdir()} == {path, *(each for each in left if each.name.startswith(".drive-2"))}
    assert not other.movies.failed


def test_on_a_file_system_without_locks_a_movie_removes_nothing(simulation, tmp_path, monkeypatch):
    """Without locks, the file of a killed simulator looks like one that is being written."""
    unfinished = tmp_path / ".drive.mp4-x.unfinished"
    unfinished.touch()
    monkeypatch.setattr("fcntl.flock", failing(errno.ENOLCK))

    simulation.movies.start(movie(tmp_path / "drive.mp4"))
    simulation.step(40)
    simulation.movies.stop()

    assert {*tmp_path.iterdir()} == {tmp_path / "drive.mp4", unfinished}
    assert not simulation.movies.failed


def test_a_movie_may_be_faster_than_the_simulation(simulation, tmp_path):
    """A user can watch a long drive in a short movie.

    Here four seconds of simulated time are one second of the movie.
    """
    simulation.movies.start(movie(tmp_path / "fast.mp4", acceleration=4))
    simulation.step(1600)
    simulation.movies.stop()

    pictures, rate = frames(tmp_path / "fast.mp4")
    assert (len(pictures), rate) == (10, 25)


@pytest.mark.parametrize(
    ("acceleration", "basic_step_ms", "expected_ms"),
    [(1, 20, 40), (1, 32, 32), (1, 64, 64), (1, 16, 32), (1, 15, 45), (4, 32, 160)],
)
def test_a_frame_comes_after_whole_steps(acceleration, basic_step_ms, expected_ms):
    """The interval between frames is the multiple of the basic step that is nearest to 40 ms of the movie."""
    assert frame_step_ms(acceleration, basic_step_ms) == expected_ms


def test_the_frames_in_a_second_follow_from_the_steps(simulation, tmp_path):
    """With another frame rate the movie would be too fast or too slow."""
    source = WORLD.replace("basicTimeStep 20", "basicTimeStep 32").encode()
    simulation = Simulation.load(source, MujocoPhysics(), "world", Mode.FAST)
    simulation.movies.start(movie(tmp_path / "it.mp4"))
    simulation.step(320)
    simulation.movies.stop()

    assert frames(tmp_path / "it.mp4")[1] == Fraction(125, 4)


def test_a_movie_that_cannot_be_written_fails_at_the_start(simulation, tmp_path, caplog):
    """A user must not learn only at the end that the movie is missing.

    The log has one line with the path and the error.
    """
    assert not simulation.movies.start(movie(tmp_path / "none" / "it.mp4"))

    assert simulation.movies.failed
    assert "it.mp4: No such file or directory" in caplog.text


def test_a_movie_without_a_step_fails(simulation, tmp_path, caplog):
    """A movie without a frame cannot be played, so it fails and leaves no file."""
    simulation.movies.start(movie(tmp_path / "it.mp4"))
    simulation.movies.stop()

    assert simulation.movies.failed
    assert simulation.movies.ready
    assert "the simulation did not run" in caplog.text
    assert list(tmp_path.iterdir()) == []


def test_a_movie_whose_folder_is_gone_fails_at_its_end(simulation, tmp_path, caplog):
    """The error of the movie must not end the simulation."""
    folder = tmp_path / "films"
    folder.mkdir()
    simulation.movies.start(movie(folder / "it.mp4"))
    simulation.step(40)
    shutil.rmtree(folder)
    simulation.movies.stop()

    assert simulation.movies.failed
    assert "No such file" in caplog.text


@pytest.mark.parametrize(
    ("changes", "fact"),
    [
        ({"path": "it.avi"}, "only MP4 files are written"),
        ({"size": (63, 48)}, "use even numbers"),
        ({"size": (64, 0)}, "use even numbers"),
        ({"quality": 0}, "a quality from 1 to 100"),
        ({"acceleration": 0}, "an acceleration of at least 1"),
    ],
)
def test_what_cannot_be_recorded_is_refused(simulation, changes, fact):
    """The message names the supported values."""
    with pytest.raises(UnsimulatedError, match=fact):
        simulation.movies.start(movie(**{"path": "it.mp4", **changes}))
    assert simulation.movies.failed


def test_one_movie_is_recorded_at_a_time(simulation, tmp_path):
    """A second request must not spoil the movie that is being recorded, so it fails."""
    simulation.movies.start(movie(tmp_path / "it.mp4"))

    with pytest.raises(UnsimulatedError, match="stop it first"):
        simulation.movies.start(movie(tmp_path / "other.mp4"))


def test_without_the_library_the_refusal_names_what_to_install(simulation, tmp_path, monkeypatch):
    """The library is loaded only for the first movie, so the simulator starts without it."""
    monkeypatch.setitem(sys.modules, "av", None)

    with pytest.raises(UnsimulatedError, match=r"install palaestra-sim\[mujoco\]"):
        simulation.movies.start(movie(tmp_path / "it.mp4"))


def test_a_simulator_without_pictures_records_none(tmp_path):
    """Webots with `--no-rendering` records no movie either. A request to stop one is then not an error."""
    simulation = Simulation.load(WORLD.encode(), StubPhysics(), "world", Mode.FAST)

    assert not simulation.movies.start(movie(tmp_path / "it.mp4"))
    assert simulation.movies.failed
    simulation.movies.stop()
