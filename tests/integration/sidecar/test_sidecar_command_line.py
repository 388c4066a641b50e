"""The command line of the sidecar, and the errors for mistakes in it."""

import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from palaestra_sim.world import RunIdentity, ros_name
from tests.integration.sidecar.conftest import DEADLINE_S

PROGRAM = str(Path(sys.executable).with_name("palaestra-sidecar"))
STANDARD = (1 << 31) - 1  # the mask of all signals except real-time signals


def run(*arguments):
    """Run a sidecar that ends by itself, and return the result."""
    return subprocess.run(
        [PROGRAM, *map(str, arguments)], capture_output=True, text=True, timeout=20, check=False
    )


def test_help_says_what_it_reads_and_writes_and_how_it_ends() -> None:
    """A user who starts the program without knowledge of it reads the help first."""
    told = run("--help")

    assert told.returncode == 0
    assert all(word in told.stdout for word in ("reads ", "prints ", "serves ", "exit codes: 0 "))


@pytest.mark.parametrize(
    ("arguments", "line"),
    [
        (["--driver=gazebo"], "argument --driver: invalid choice: 'gazebo' (choose from 'stub', "),
        (["--world=/no.wbt"], "--world: /no.wbt: No such file or directory; give a .wbt or .xml file"),
        (["--control=7100"], "argument --control: '7100' is not an address such as 127.0.0.1:7100; see"),
        (
            ["--control=0.0.0.0:0"],
            "--control: 0.0.0.0:0 is not a loopback address; use 127.0.0.1 or [::1], or add --allow-remote-",
        ),
        (["--until-silent=0"], "argument --until-silent: 0 is refused; give 1 or more; see --help"),
        (["--health=203.0.113.1:0"], "--health: 203.0.113.1:0: Cannot assign requested address; "),
        (["--job=j"], "--work: is missing, but required with --job; give the folder"),
        (["--standby"], "--standby: two simulators need different ROS names; give --job and --work"),
        (["--job=j", "--work=/proc/x"], "--work: /proc/x: No such file or directory; give a writable folder"),
        (["--driver=command"], "--driver command: has no program; add it after --, as in -- sim {world}"),
        (
            ["--driver=command", "--", "no-such"],
            "--driver command: the program no-such was not found; install",
        ),
        (
            ["--", "sim"],
            "--driver stub: does not take a program; remove the program, or use --driver command",
        ),
        (["--speed=2"], "unrecognized arguments: --speed=2; see --help"),
    ],
)
def test_a_mistake_is_one_line_and_nothing_is_started(world, arguments, line) -> None:
    """The user gets one line and exit code 2, before the sidecar opens a port."""
    told = run("--driver=stub", f"--world={world}", "--control=127.0.0.1:0", *arguments)

    assert (told.returncode, told.stdout) == (2, "")
    assert told.stderr.startswith(f"palaestra-sidecar: {line}")
    assert told.stderr.count("\n") == 1


def test_the_error_for_a_broken_world_has_line_and_column(tmp_path) -> None:
    """With line and column, an editor can open the place of the mistake."""
    world = tmp_path / "broken.wbt"
    world.write_text("#VRML_SIM R2023b utf8\nRobot { name \n}\n")

    told = run("--driver=stub", f"--world={world}")

    assert told.returncode == 2
    assert told.stderr.startswith(f"palaestra-sidecar: {world}:3:1: ")


def test_the_simulator_gets_a_world_with_its_own_names(sidecar, tmp_path) -> None:
    """The trainer finds its robots by the names in /state, so these must be the names in the world."""
    program = "import sys\nprint('world', sys.argv[2])\nprint('up')\nsys.stdin.read()"
    it = sidecar(program, f"--work={tmp_path}/work", "--job=j", "--uid=u", "--replica=1", "--group=eval")
    identity = RunIdentity(job="j", uid="u", replica=1, group="eval", index=0)

    state = it.state

    assert state.world == f"{tmp_path}/work/eval-0.wbt"
    assert state.robots[0].ros_name == ros_name(identity, "robotino")
    assert state.robots[0].ros_name in Path(state.world).read_text()


def test_without_a_job_the_world_runs_as_it_is(sidecar, waits, world) -> None:
    """A user who tries a simulator by hand expects the robot names of the world file."""
    state = sidecar(waits).state

    assert state.world == str(world)
    assert state.robots[0].ros_name == "robotino"


def test_a_world_that_ships_needs_no_path(sidecar, waits) -> None:
    """A notebook names an included world without a path."""
    state = sidecar(waits, "--world=arena").state

    assert Path(state.world).name == "arena.wbt"
    assert state.robots[0].robot == "robotino"


def test_a_sidecar_may_end_with_its_standard_input(arguments, waits) -> None:
    """A notebook that is killed cannot send a signal, but the kernel closes its pipes."""
    command = arguments(waits, "--until-stdin-closes")
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        process.stdout.readline()

        process.stdin.close()

        assert process.wait(DEADLINE_S) == 0


def test_a_sidecar_may_end_when_its_client_is_silent_and_may_listen_for_other_machines(arguments, waits):
    """The kernel of a notebook in another pod may be killed, and no connection shows that."""
    others = ("--control=0.0.0.0:0", "--allow-remote-control", "--until-silent=1")
    with subprocess.Popen(arguments(waits, *others), stdout=subprocess.PIPE, text=True) as process:
        first = process.stdout.readline()

        said, _ = process.communicate(timeout=DEADLINE_S)

    assert re.search(r" control=(\[::\]|0\.0\.0\.0):\d", first)
    assert "ends: no request to the control port for 1 s" in said
    assert process.returncode == 0


def test_options_come_last_on_the_simulators_command_line(sidecar) -> None:
    """A simulator's option may occur several times, in order, and may begin with two dashes."""
    program = "import sys\nprint('got', sys.argv[2:])\nprint('up')\nsys.exit(0)"
    it = sidecar(program, "--option=--a=1", "--option=b c")

    it.start()

    assert "got ['--a=1', 'b c']" in it.lines


def test_a_simulator_has_its_signals_as_a_shell_would_give_them(sidecar) -> None:
    """With an ignored SIGPIPE, as in Python, a simulator would write to a closed pipe forever.

    A signal that the sidecar's parent ignores, as nohup ignores SIGHUP, stays ignored, as in a shell.
    """
    it = sidecar(["sh", "-c", "grep -E '^Sig(Ign|Blk)' /proc/self/status; echo up; sleep 60"])

    it.start()

    masks = [int(line.split()[1], 16) for line in it.lines if line.startswith("Sig")]
    assert [mask & STANDARD & ~_ignored_around_us() for mask in masks] == [0, 0]


def _ignored_around_us():
    """Return the mask of signals that this process has ignored since its start.

    Two signals that Python itself ignores are excluded.
    """
    (line,) = (
        line for line in Path("/proc/self/status").read_text().splitlines() if line.startswith("SigIgn")
    )
    pythons_own = 1 << (signal.SIGPIPE - 1) | 1 << (signal.SIGXFSZ - 1)
    return int(line.split()[1], 16) & ~pythons_own


def test_a_simulator_gets_none_of_our_files(sidecar) -> None:
    """A simulator with the reaper's pipe open would keep itself alive."""
    it = sidecar(["sh", "-c", "for fd in /proc/$$/fd/*; do readlink $fd; done; echo up; sleep 60"])

    it.start()

    files = it.lines[it.lines.index("/dev/null") : it.lines.index("up")]
    assert files[0] == "/dev/null"
    assert len(files) == 3
    assert files[1] == files[2]
