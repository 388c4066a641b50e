"""`palaestra run`: train on this machine."""

import argparse
from contextlib import nullcontext
from importlib.metadata import version
from pathlib import Path

from palaestra.api import TrainingJob
from palaestra.cli.files import add_dir, job
from palaestra.cli.subcommands import Commands, command
from palaestra.errors import PalaestraError
from palaestra.job_input import changed
from palaestra.live_view.view_process import viewed
from palaestra.local.run import RunOptions, run
from palaestra_protocol.numbers import MOST_PORT, whole
from palaestra_protocol.policy_package import MODEL, PackageError, is_package, read_package

RUN = """\
Trains as the TrainingJob in FILE specifies, and prints a line about its progress every 10 s. Writes
<dir>/<job name>/<replica>/: checkpoints/, tensorboard/, evaluations.jsonl, model.zip, the source worlds,
training.yaml and logs/. The same command resumes from the newest checkpoint, and with more trainer.steps in
FILE it prolongs a finished run. Replicas run one after another; --replica chooses one. Ctrl-C saves a
checkpoint and exits; a second Ctrl-C exits at once. SIGTERM and SIGHUP act as Ctrl-C; a SIGINT or SIGHUP that
was ignored at the start, as by nohup or in the background of a script, stays ignored.
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "run", _run, RUN)
    parser.add_argument("file", metavar="FILE", type=Path, help="a TrainingJob")
    add_dir(parser)
    parser.add_argument("--replica", metavar="N", type=whole(), help="this replica only")
    parser.add_argument(
        "--fresh", action="store_true", help="start from the beginning; an existing run is moved aside"
    )
    parser.add_argument(
        "--initial-policy",
        metavar="PATH",
        type=Path,
        help="run directory, package (folder or zip) or model.zip with the policy of a new run, as "
        "trainer.initialPolicy",
    )
    parser.add_argument(
        "--ros-port",
        metavar="PORT",
        type=whole(1, MOST_PORT),
        help="port of the ROS master; default: a free one",
    )
    parser.add_argument("--view", action="store_true", help="show the simulators in a browser; see `view`")
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="show all logs, each line with its container"
    )


def _run(options: argparse.Namespace) -> int:
    wanted = _wanted(options)
    folder = options.dir / wanted.metadata.name / str(options.replica or 0)
    with viewed(folder) if options.view else nullcontext():
        return run(
            wanted,
            RunOptions(
                runs=options.dir,
                version=version("palaestra"),
                replica=options.replica,
                fresh=options.fresh,
                verbose=options.verbose,
                ros_port=options.ros_port,
            ),
        )


def _wanted(options: argparse.Namespace) -> TrainingJob:
    """Return the job in the file; the command line may replace its initial policy.

    Raises:
        PalaestraError: the file cannot be read, or the job is invalid, or a package is damaged.
    """
    given, policy = job(options.file), options.initial_policy
    if policy is None:
        return given
    if is_package(policy):
        try:
            read_package(policy, MODEL)
        except PackageError as error:
            raise PalaestraError(str(error)) from error
    model = policy / MODEL if policy.is_dir() else policy
    return changed(given, {"trainer.initialPolicy": {"path": str(model.absolute())}})
