"""The command line of `palaestra`: arguments in, text and an exit code out; the work is elsewhere."""

import argparse
import sys
from collections.abc import Callable, Sequence
from importlib.metadata import version
from pathlib import Path
from typing import Any, Protocol

from palaestra.api import TrainingJob, load
from palaestra.api.generated import crd_text
from palaestra.errors import PalaestraError
from palaestra.local.errors import LocalError
from palaestra.local.replica import KILLED
from palaestra.local.run import Options, run
from palaestra.local.rundir import job_directory, uid_of
from palaestra.plan import ClusterLayout, Images, Layout, LocalLayout, identified, plan
from palaestra.plan.text import as_yaml
from palaestra_sim.errors import SimError
from palaestra_sim.world import RunIdentity, generate

WRONG_INPUT = 2
UNASSIGNED = "00000000-0000-0000-0000-000000000000"  # stands for the uid that a cluster gives

EXIT_CODES = """\
exit codes:
  0    done
  1    failed; the last lines of the log say why
  2    the job, a world or this machine is not as it must be; nothing was started
  75   interrupted and checkpointed; the same command goes on
  80   a simulator's budget for faults is spent
  81   training diverged
  82   training stalled
  130  killed by a second Ctrl-C; the same command goes on from the newest checkpoint
"""
RUN = """\
Reads the TrainingJob in FILE and writes <dir>/<job name>/<replica>/: checkpoints/, tensorboard/,
evaluations.jsonl, model.zip, the generated worlds, training.yaml and logs/. Typed again it goes on from
the newest checkpoint. Replicas run one after another; --replica picks one.
Ctrl-C ends it with a checkpoint, a second one at once.
"""
PLAN = """\
Reads the TrainingJob in FILE and writes the Kubernetes objects that it needs to standard output, as
YAML. Outside a cluster the job has no uid yet: zeros stand in its place.
"""
WORLD = """\
Reads the world in FILE and writes it to standard output as one simulator of a job gets it: its robots
have ROS names of their own and nothing else is changed.
"""
CRD = "Writes the CustomResourceDefinition of TrainingJobs to standard output, as YAML."


class Commands(Protocol):
    """What argparse gives for adding commands; its own class has no public name."""

    def add_parser(self, *args: Any, **options: Any) -> argparse.ArgumentParser:
        """Return the parser of a new command."""
        ...


def main(arguments: Sequence[str] | None = None) -> int:
    """Run one command and return its exit code."""
    options = _parser().parse_args(arguments)
    command: Callable[[argparse.Namespace], int] = options.command
    try:
        return command(options)
    except LocalError as error:
        return _failed(error, error.exit_code)
    except (PalaestraError, SimError) as error:
        return _failed(error, WRONG_INPUT)
    except KeyboardInterrupt:  # before anything was started
        return KILLED


def _failed(error: Exception, exit_code: int) -> int:
    sys.stderr.write(f"{error}\n")
    return exit_code


def _run(options: argparse.Namespace) -> int:
    return run(
        _job(options.file),
        Options(
            runs=options.dir,
            version=version("palaestra"),
            replica=options.replica,
            fresh=options.fresh,
            verbose=options.verbose,
            ros_port=options.ros_port,
        ),
    )


def _plan(options: argparse.Namespace) -> int:
    job = _job(options.file)
    images = Images.of_release(version("palaestra"))
    layout: Layout = ClusterLayout(images=images)
    uid = job.metadata.uid or UNASSIGNED
    if options.layout == "local":
        directory = job_directory(options.dir, job.metadata.name)
        layout, uid = LocalLayout(images=images, job_directory=str(directory)), uid_of(directory)
    sys.stdout.write(as_yaml(plan(identified(job, uid), layout).objects))
    return 0


def _world(options: argparse.Namespace) -> int:
    identity = RunIdentity(
        job=options.job,
        namespace=options.namespace,
        uid=options.uid,
        replica=options.replica,
        group=options.group,
        index=options.index,
    )
    world = generate(
        _read(options.file),
        identity,
        clock=options.clock,
        name=str(options.file),
        relative_addresses=True,
    )
    sys.stdout.write(world.decode())
    return 0


def _crd(options: argparse.Namespace) -> int:
    del options
    sys.stdout.write(crd_text())
    return 0


def _job(file: Path) -> TrainingJob:
    try:
        text = _read(file).decode()
    except UnicodeDecodeError:
        raise PalaestraError(f"{file}: is not UTF-8; save it as UTF-8") from None
    return load(text, str(file))


def _read(file: Path) -> bytes:
    try:
        return file.read_bytes()
    except OSError as error:
        raise PalaestraError(f"{file}: {error.strerror}; name a file that can be read") from error


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="palaestra",
        description="Train robots in simulators, from a TrainingJob.",
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.add_argument("--version", action="version", version=f"palaestra {version('palaestra')}")
    commands = parser.add_subparsers(required=True, metavar="COMMAND")
    _add_run(commands)
    _add_plan(commands)
    _add_world(commands)
    _command(commands, "crd", _crd, "print the CustomResourceDefinition", CRD)
    return parser


def _command(
    commands: Commands,
    name: str,
    function: Callable[[argparse.Namespace], int],
    summary: str,
    description: str,
) -> argparse.ArgumentParser:
    parser = commands.add_parser(
        name,
        help=summary,
        description=description,
        epilog=EXIT_CODES,
        formatter_class=argparse.RawDescriptionHelpFormatter,
    )
    parser.set_defaults(command=function)
    return parser


def _add_run(commands: Commands) -> None:
    parser = _command(commands, "run", _run, "train on this machine", RUN)
    parser.add_argument("file", metavar="FILE", type=Path, help="a TrainingJob")
    _add_dir(parser)
    parser.add_argument("--replica", metavar="N", type=int, help="this replica only")
    parser.add_argument("--fresh", action="store_true", help="begin anew; what was there is moved aside")
    parser.add_argument(
        "--ros-port", metavar="PORT", type=int, help="port of the ROS master; default: a free one"
    )
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="show all logs, each line with its container"
    )


def _add_plan(commands: Commands) -> None:
    parser = _command(commands, "plan", _plan, "print the objects that a job needs", PLAN)
    parser.add_argument("file", metavar="FILE", type=Path, help="a TrainingJob")
    parser.add_argument("--layout", choices=("cluster", "local"), default="cluster", help="for where")
    _add_dir(parser)


def _add_world(commands: Commands) -> None:
    parser = _command(commands, "world", _world, "print one simulator's own world", WORLD)
    parser.add_argument("file", metavar="FILE", type=Path, help="a world (.wbt)")
    parser.add_argument("--job", metavar="NAME", required=True, help="name of the job")
    parser.add_argument("--namespace", default="default", help="namespace of the job")
    parser.add_argument("--uid", default="", help="uid of the job in its cluster")
    parser.add_argument("--replica", type=int, default=0, help="number of the replica")
    parser.add_argument("--group", required=True, help="name of the group of simulators")
    parser.add_argument("--index", type=int, default=0, help="number in the group")
    parser.add_argument("--clock", action="store_true", help="keep a --clock that the world has")


def _add_dir(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--dir", type=Path, default=Path("runs"), help="folder of all runs; default: runs")
