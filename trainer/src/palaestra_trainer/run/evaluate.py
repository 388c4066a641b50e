"""Evaluate a saved model on the evaluating simulators of a configuration."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import structlog

from palaestra_protocol.pod.enums import ExitCode, Role
from palaestra_trainer import algorithms, checkpoint
from palaestra_trainer.configuration import Configuration, SimulatorConfiguration
from palaestra_trainer.episodes.evaluation import evaluate_on_all
from palaestra_trainer.episodes.seeds import episode_seeds
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run.attempt import STOPPED_S, MakeMembers, use_threads
from palaestra_trainer.run_directory import RunDirectory
from palaestra_trainer.simulators.fleet import Fleet
from palaestra_trainer.simulators.interface import NullWatcher
from palaestra_trainer.waiting.exit import leave_after

log = structlog.get_logger(__name__)


def _nobody(result: dict[str, Any]) -> None:
    """Ignore a result."""


def measure(
    configuration: Configuration,
    model: Path,
    make_members: MakeMembers,
    *,
    episodes: int,
    stream: str,
    report: Callable[[dict[str, Any]], object] = _nobody,
) -> dict[str, Any]:
    """Return the evaluation of a run directory's model, in the first `episodes` episodes of a seed stream.

    Only the evaluating simulators of the configuration are created and started; if it has none, the first
    collecting one is.

    Args:
        configuration: the configuration of the run.
        model: the model.zip of the run directory.
        make_members: creates the simulators.
        episodes: number of episodes.
        stream: name of the seed stream.
        report: called with the result, before simulators are stopped; if they do not stop within a minute,
            the process ends.

    Raises:
        ConfigurationError: the model is missing, or does not fit the configuration.
        FaultBudgetSpent: a simulator broke more often than its budget allows.
    """
    evaluating = _evaluating(configuration)
    if not model.exists():
        raise ConfigurationError(f"{model}: does not exist; train first, or give another run directory")
    use_threads()
    only = configuration.model_copy(update={"simulators": evaluating})
    with ExitStack() as last, ExitStack() as stack:
        fleet = Fleet(only, make_members(only), NullWatcher())
        stack.callback(fleet.stop)
        begun = algorithms.begun_with(configuration, RunDirectory(model.parent))
        task = fleet.evaluating[0].member.env
        algorithms.refuse_without_masks(begun, task, configuration.environment.id)
        fleet.start()
        env = SimulatorsVecEnv(fleet.evaluating[:1], configuration.seed)
        trained = algorithms.make_model(begun, env, configuration.seed, configuration.device)
        checkpoint.load_tensors(model, trained)
        seeds = episode_seeds(configuration.seed, stream, episodes)
        evaluation = evaluate_on_all(algorithms.policy_of(trained), fleet.evaluating, seeds)
        result = evaluation.summary() | {
            "seeds": stream,
            "run_seed": configuration.seed,
            "seconds": round(evaluation.seconds, 2),
        }
        report(result)
        last.callback(leave_after(STOPPED_S, ExitCode.DONE).cancel)
    return result


def _evaluating(configuration: Configuration) -> tuple[SimulatorConfiguration, ...]:
    """Return the simulators with role Evaluate; if none has that role, the first collecting one."""
    if found := configuration.with_role(Role.EVALUATE):
        return found
    collecting = configuration.with_role(Role.COLLECT)[0]
    log.warning("no simulator has role Evaluate: the world is that of a collecting one", name=collecting.name)
    return (collecting.model_copy(update={"role": Role.EVALUATE}),)
