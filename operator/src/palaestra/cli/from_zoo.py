"""`palaestra from-zoo`: a TrainingJob from a hyperparameter file of RL-Baselines3-Zoo."""

import argparse
import sys
from pathlib import Path

from palaestra.cli.files import read_text
from palaestra.cli.subcommands import Commands, command
from palaestra.errors import PalaestraError
from palaestra.local.files import write
from palaestra.zoo import convert

FROM_ZOO = """\
Reads a hyperparameter file of RL-Baselines3-Zoo, such as ppo.yml, and prints the TrainingJob for one of its
environments. Expressions such as dict(net_arch=[64, 64]) are read as data and never evaluated. Each
difference between the job and Zoo is a line on standard error and a comment in the job.
"""
EXIT_CODES = """\
exit codes:
  0    done
  2    FILE or an option is wrong; nothing was written
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "from-zoo", _from_zoo, FROM_ZOO, EXIT_CODES)
    parser.add_argument("file", metavar="FILE", type=Path, help="hyperparameter file, such as Zoo's ppo.yml")
    parser.add_argument(
        "--env", metavar="ID", help="environment; if FILE does not name it, the entry `default` is used"
    )
    parser.add_argument(
        "--algorithm", metavar="NAME", help="default: FILE's name, such as ppo, ppo_lstm or sac"
    )
    parser.add_argument("--out", metavar="FILE", type=Path, help="new file for the job; default: print it")


def _from_zoo(options: argparse.Namespace) -> int:
    if options.out is not None and options.out.exists():
        raise PalaestraError(f"--out: {options.out} already exists; name another file, or remove this one")
    converted = convert(
        read_text(options.file), options.file.name, env=options.env, algorithm=options.algorithm
    )
    for note in converted.notes:
        sys.stderr.write(f"{note}\n")
    if options.out is None:
        sys.stdout.write(converted.text)
    else:
        write(options.out, converted.text.encode())
    return 0
