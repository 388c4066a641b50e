"""`palaestra-try` plays a few episodes in a job's environment, before any training."""

from __future__ import annotations

import argparse
import json
import sys
import textwrap
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from palaestra_protocol.imports import import_without, without_collections

# If structlog finds rich, it formats tracebacks with rich, but the log must have plain text.
import_without("rich", "structlog")

from palaestra_protocol.linux import require_linux
from palaestra_protocol.numbers import whole
from palaestra_protocol.pod.enums import Role
from palaestra_protocol.pod.status import ExitCode
from palaestra_trainer.cli.program import leaving, parser, refuse_without_run, write_line
from palaestra_trainer.errors import ConfigurationError, TrainerError
from palaestra_trainer.job.configuration import Configuration, load_run
from palaestra_trainer.run.signals import Interruption
from palaestra_trainer.run.telemetry.logs import configure_logs

if TYPE_CHECKING:
    from palaestra_trainer.run.trying.agents import Agent
    from palaestra_trainer.simulators.restarter import Restarter

AGENTS = ("zero", "random", "keyboard")
FAILED = 1
_WIDEST = 100

TRY = """\
Play a few episodes in the environment of a run directory, in its first collecting simulator. Nothing is
learned.

reads:
  RUN_DIR/training.yaml; the worlds in RUN_DIR, which local processes load; with --agent keyboard the terminal
writes:
  a line for each episode, the times of a step, and a sentence for each problem to standard output, or with
  --json one JSON object
"""
EXIT_CODES = """\
exit codes:
  0   no problem found
  1   problems found, or any other error
  2   the configuration, the run directory or the agent is wrong; nothing was started
  80  a simulator failed more often than its restart budget allows
  130 ended by Ctrl-C
"""


def attempt(arguments: Sequence[str] | None = None) -> int:
    """Run `palaestra-try`; return its exit code."""
    options = parser("palaestra-try", TRY, EXIT_CODES)
    options.add_argument("run", type=Path, metavar="RUN_DIR", help="run directory with a training.yaml")
    options.add_argument(
        "--agent", choices=AGENTS, default="random", help="source of the actions (default: random)"
    )
    options.add_argument("--episodes", type=whole(1), default=10, help="number of episodes (default: 10)")
    options.add_argument("--json", action="store_true", help="print one JSON object at the end")
    chosen = options.parse_args(arguments)
    require_linux("palaestra-try")
    configure_logs()
    try:
        with Interruption() as interruption:
            return _attempt(chosen, interruption)
    # The environment's code may raise SystemExit.
    except (KeyboardInterrupt, TrainerError, OSError, SystemExit) as error:
        return refuse_without_run(error)


def try_and_leave() -> int:
    """Run `palaestra-try`, and end the process soon even if a thread of the job's code still runs."""
    return leaving(attempt)


def _attempt(chosen: argparse.Namespace, interruption: Interruption) -> int:
    if chosen.agent == "keyboard" and not sys.stdin.isatty():
        raise ConfigurationError(
            "--agent keyboard: the standard input is not a terminal, so no keys can be read; "
            "run it in a terminal, or use --agent random"
        )
    with without_collections():
        from palaestra_trainer.run.trying import episodes, report
        from palaestra_trainer.simulators.connect import connect_here
        from palaestra_trainer.simulators.fleet import Fleet
        from palaestra_trainer.simulators.interface import NullWatcher

    configuration = _alone(load_run(chosen.run))
    fleet = Fleet(configuration, connect_here(configuration, run=chosen.run), NullWatcher())
    say = _drop if chosen.json else write_line

    try:
        [restarter] = fleet.collecting
        with _agent(chosen, restarter, configuration.seed, interruption) as (agent, legend):
            for line in (*_head(configuration, restarter), *legend):
                say(line)
            fleet.start(interruption.check)
            seeds = episodes.seeds(configuration.seed, chosen.episodes)
            tried = episodes.play(
                restarter,
                agent,
                seeds,
                interruption.check,
                lambda number, episode: say(report.line_of(number, episode)),
            )
    finally:
        fleet.stop()
    if chosen.json:
        write_line(json.dumps(report.as_json(tried)))
    for line in report.summary(tried):
        say(line)
    return FAILED if tried.problems else ExitCode.DONE


@contextmanager
def _agent(
    chosen: argparse.Namespace, restarter: Restarter, seed: int, interruption: Interruption
) -> Iterator[tuple[Agent, list[str]]]:
    """Yield the agent, and lines that explain the keys to a person who drives the robot."""
    from palaestra_trainer.run.trying import agents, keyboard, keymap

    env = restarter.member.env
    if chosen.agent == "keyboard":
        names = agents.names_of_actions(env)
        keys = keymap.keys_of(env.action_space, names)
        with keyboard.keys_at_once() as terminal:
            show = _drop if chosen.json else write_line
            driver = keyboard.KeyboardDriver(terminal, keys, interruption.check, show)
            yield driver, [keymap.legend(keys, names)]
    elif chosen.agent == "zero":
        yield agents.Zero(env.action_space), []
    else:
        yield agents.Random(env.action_space, seed), []


def _alone(configuration: Configuration) -> Configuration:
    """Return the configuration with only its first collecting simulator."""
    first = configuration.with_role(Role.COLLECT)[0]
    alone = first.model_copy(update={"min_simulators": None, "standby": False})
    return configuration.model_copy(update={"simulators": (alone,)})


def _head(configuration: Configuration, restarter: Restarter) -> list[str]:
    env, [simulator] = restarter.member.env, configuration.simulators
    return [
        f"{configuration.environment.id} in {simulator.name} ({simulator.driver})",
        f"actions: {_short(env.action_space)}",
        f"observations: {_short(env.observation_space)}",
    ]


def _short(space: object) -> str:
    """Return a space as one line of text."""
    return textwrap.shorten(str(space), _WIDEST, placeholder=" ...")


def _drop(line: str) -> None:
    """Ignore a line, because the output is JSON."""
