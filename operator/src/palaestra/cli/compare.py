"""`palaestra compare`: compare the policies of two runs on the same fresh episodes."""

import argparse
from pathlib import Path

from palaestra.cli.subcommands import Commands, command
from palaestra.local.trainer_program import run_program
from palaestra_protocol.numbers import whole

PROGRAM = "palaestra-compare"
COMPARE = """\
Plays the policies of the run directories A and B on the same episodes, in the simulator that evaluates A's
policy. Ends when the results show that one policy succeeds more often, or that the success rates differ by no
more than --margin. No run uses the seeds of these episodes. Prints a line for each 20 episodes and a sentence
at the end. After any number of episodes, the probability that the result is wrong is at most 5 %. This is
true even if you end a comparison early, or repeat it with more --episodes.
"""
EXIT_CODES = """\
exit codes:
  0    one policy is better, or they differ by no more than the margin
  1    any other error; the last lines of the log give the reason
  2    a run directory is wrong, the policies have different tasks, or palaestra-trainer is not installed
  3    undecided after all episodes
  80   a simulator had more faults than its restart budget allows
  130  ended by Ctrl-C
"""


def add(commands: Commands) -> None:
    """Add the command."""
    parser = command(commands, "compare", _compare, COMPARE, EXIT_CODES)
    parser.add_argument("a", metavar="A", type=Path, help="run directory, such as runs/<job>/<replica>")
    parser.add_argument("b", metavar="B", type=Path, help="run directory of the other policy")
    parser.add_argument("--episodes", metavar="N", type=whole(1), help="most episodes; default: 1000")
    parser.add_argument(
        "--margin",
        metavar="SHARE",
        help="success rates that differ by no more than this count as equal; default: 0.05",
    )
    parser.add_argument(
        "--in", metavar="NAME", dest="driver", help="stub, mujoco or webots; default: the simulator of A"
    )
    parser.add_argument("--seeds", metavar="NAME", help="name that selects the episodes; default: compare")
    parser.add_argument("--json", action="store_true", help="print one JSON object at the end")


def _compare(options: argparse.Namespace) -> int:
    given = {
        "--episodes": options.episodes,
        "--margin": options.margin,
        "--in": options.driver,
        "--seeds": options.seeds,
    }
    chosen = [f"{name}={value}" for name, value in given.items() if value is not None]
    json = ["--json"] if options.json else []
    return run_program([PROGRAM, str(options.a), str(options.b), *chosen, *json])
