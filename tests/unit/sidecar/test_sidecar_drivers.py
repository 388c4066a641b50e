"""The command line that a sidecar builds for each simulator."""

from pathlib import Path

import pytest

from palaestra_sim.errors import SidecarError
from palaestra_sim.sidecar.drivers import Driver, Launch, command

WORLD = Path("/worlds/collect-0.wbt")


@pytest.fixture
def path(tmp_path):
    """Return a function that creates executable programs and returns a PATH with their folder."""

    def make(*programs):
        for program in programs:
            (tmp_path / program).write_text("#!/bin/sh\n")
            (tmp_path / program).chmod(0o755)
        return str(tmp_path)

    return make


def test_the_stub_gets_the_world_and_its_options(path) -> None:
    """The options of the job come last."""
    folder = path("palaestra-stub")

    started = command(
        Driver.STUB, Launch(world=WORLD, options=["--step-sleep=3"]), {"PATH": folder, "A": "b"}
    )

    assert started.arguments == (f"{folder}/palaestra-stub", str(WORLD), "--step-sleep=3")
    assert started.environment == {"PATH": folder, "A": "b"}


def test_mujoco_gets_the_world_and_its_options(path) -> None:
    """MuJoCo has the same options as the stub, so a job can switch between them."""
    folder = path("palaestra-mujoco")

    started = command(Driver.MUJOCO, Launch(world=WORLD, options=["--leave-out", "all"]), {"PATH": folder})

    assert started.arguments == (f"{folder}/palaestra-mujoco", str(WORLD), "--leave-out", "all")


def test_mujoco_draws_on_one_thread(path) -> None:
    """Several simulators share the cores, so each software renderer uses one thread."""
    started = command(Driver.MUJOCO, Launch(world=WORLD), {"PATH": path("palaestra-mujoco")})

    assert started.environment["LP_NUM_THREADS"] == "0"


def test_mujoco_is_not_told_how_to_draw(path) -> None:
    """With `MUJOCO_GL` set, MuJoCo would load OpenGL at its start, and fail on a machine without it."""
    started = command(Driver.MUJOCO, Launch(world=WORLD), {"PATH": path("palaestra-mujoco")})

    assert "MUJOCO_GL" not in started.environment


def test_variables_of_the_job_decide_how_mujoco_draws(path) -> None:
    """A user's image may have another OpenGL library or a GPU."""
    given = {"PATH": path("palaestra-mujoco"), "MUJOCO_GL": "osmesa", "LP_NUM_THREADS": "4"}

    assert command(Driver.MUJOCO, Launch(world=WORLD), given).environment == given


def test_webots_starts_paused_without_a_screen_and_prints(path) -> None:
    """Webots starts paused; the trainer sets the mode when it is ready to step."""
    folder = path("webots")

    started = command(Driver.WEBOTS, Launch(world=WORLD, options=["--port=1235"]), {"PATH": folder})

    assert " ".join(started.arguments) == (
        f"{folder}/webots --batch --mode=pause --stdout --stderr --minimize --no-rendering "
        f"{WORLD} --port=1235"
    )


@pytest.mark.parametrize(
    ("options", "view"),
    [
        ([], "--minimize --no-rendering "),
        (["--stream"], "--minimize --no-rendering "),
        (["--stream=mjpeg"], ""),
    ],
)
def test_the_main_view_of_webots_is_rendered_only_for_its_pictures(path, options, view) -> None:
    """Cameras are rendered in any case; the stream mjpeg and movies are pictures of the main view."""
    folder = path("webots")

    started = command(Driver.WEBOTS, Launch(world=WORLD, options=options), {"PATH": folder})

    assert " ".join(started.arguments) == " ".join(
        [f"{folder}/webots --batch --mode=pause --stdout --stderr {view}{WORLD}", *options]
    )


@pytest.mark.parametrize(("given", "user"), [({}, "palaestra"), ({"USER": "maria"}, "maria")])
def test_webots_always_has_a_user(path, given, user) -> None:
    """Webots names its temporary folder after the variable `USER`, which a container does not set."""
    started = command(Driver.WEBOTS, Launch(world=WORLD), {"PATH": path("webots"), **given})

    assert started.environment["USER"] == user


def test_a_program_of_ones_own_gets_the_world_where_it_asks_for_it(path) -> None:
    """A user's program may need the world anywhere in its command line, even as a part of an argument."""
    folder = path("my-sim")
    launch = Launch(world=WORLD, options=["--fast"], program=["my-sim", "--scene={world}", "-v"])

    started = command(Driver.COMMAND, launch, {"PATH": folder})

    assert started.arguments == (f"{folder}/my-sim", f"--scene={WORLD}", "-v", "--fast")


def test_a_missing_program_is_named(tmp_path) -> None:
    """The sidecar reports the missing program before it starts anything; a retry cannot help."""
    with pytest.raises(SidecarError, match=r"^--driver webots: the program webots was not found; install it"):
        command(Driver.WEBOTS, Launch(world=WORLD), {"PATH": str(tmp_path)})


def test_a_driver_without_a_program_says_where_to_put_one() -> None:
    """Users often forget the `--` in front of their program."""
    with pytest.raises(SidecarError, match=r"^--driver command: has no program; add it after --"):
        command(Driver.COMMAND, Launch(world=WORLD), {})


def test_the_programs_beside_our_own_python_are_found_without_a_path(tmp_path) -> None:
    """A user may start the sidecar from a virtual environment that is not activated."""
    started = command(Driver.STUB, Launch(world=WORLD), {"PATH": str(tmp_path)})

    assert Path(started.arguments[0]).name == "palaestra-stub"
