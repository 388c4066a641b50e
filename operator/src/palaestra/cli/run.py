"""`palaestra run`: train on this machine."""

import argparse
from importlib.metadata import version
from pathlib import Path

from palaestra.cli.files import add_dir, job
from palaestra.cli.parsing import Commands, command
from palaestra.local.run import Options, run
from palaestra_protocol.numbers import MOST_PORT, whole

RUN = """\
Trains as the TrainingJob in FILE specifies, and writes <dir>/<job name>/<replica>/: checkpoints/,
tensorboard/, evaluations.jsonl, model.zip, the source worlds, training.yaml and logs/. The same command
resumes from the newest checkpoint. Replicas run one after another; --replica chooses one. Ctrl-C saves a
checkpoint and exits; a second Ctrl-C exits at once. SIGTERM and SIGHUP act as Ctrl-C; a SIGINT or SIGHUP
that was ignored at the start, as by nohup or in the background of a script, stays ignored.
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
        "--ros-port",
        metavar="PORT",
        type=whole(1, MOST_PORT),
        help="port of the ROS master; default: a free one",
    )
    parser.add_argument(
        "-v", "--verbose", action="store_true", help="show all logs, each line with its container"
    )


def _run(options: argparse.Namespace) -> int:
    return run(
        job(options.file),
        Options(
            runs=options.dir,
            version=version("palaestra"),
            replica=options.replica,
            fresh=options.fresh,
            verbose=options.verbose,
            ros_port=options.ros_port,
        ),
    )
