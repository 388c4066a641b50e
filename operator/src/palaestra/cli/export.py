"""`palaestra export`: a policy, or the recorded episodes of a run, as one file for other programs."""

from __future__ import annotations

import argparse
from pathlib import Path

from palaestra.cli.subcommands import Commands, command
from palaestra.local.trainer_program import run_program

PROGRAM = "palaestra-export"
EXPORT = """\
Writes the best policy of the run directory RUN as one file, for programs without Palaestra or PyTorch. For
an observation as the environment returns it, the file returns the action as the environment takes it. The
file is written only if it returns the actions of the policy for 1,000 observations. It contains a data sheet
of observations and actions, and the environment, steps and success of the run. Export only runs that you
trust.

With --to mcap, the command writes the recorded episodes of the run instead, as a bag of ROS 2.
"""
EXIT_CODES = """\
exit codes:
  0    done
  1    any other error, such as a file that would act differently; nothing was written
  2    RUN or the file name is wrong, or the extra of palaestra-trainer is not installed
  130  ended by Ctrl-C
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "export", _export, EXPORT, EXIT_CODES)
    parser.add_argument("run", metavar="RUN", type=Path, help="run directory, such as runs/<job>/<replica>")
    parser.add_argument(
        "--to",
        choices=("onnx", "safetensors", "package", "mcap"),
        required=True,
        help="onnx runs by itself; safetensors has the tensors for a network that you build. A package is a "
        "folder or zip with the ONNX file, the model, the job, and a manifest with a checksum of each. The "
        "format mcap is a ROS 2 bag of the recorded episodes",
    )
    parser.add_argument(
        "--output",
        metavar="FILE",
        type=Path,
        help="default: RUN/policy.<format>, RUN/package or RUN/episodes.mcap. With a name that ends in .zip, "
        "a package is one file",
    )
    parser.add_argument(
        "--evaluated",
        metavar="FILE",
        type=Path,
        help="with --to package: further results of the policy for the manifest, as `palaestra-eval RUN --in "
        "stub,mujoco --json` prints them",
    )


def _export(options: argparse.Namespace) -> int:
    given = {"--output": options.output, "--evaluated": options.evaluated}
    chosen = [word for name, path in given.items() if path is not None for word in (name, str(path))]
    return run_program([PROGRAM, str(options.run), "--to", options.to, *chosen])
