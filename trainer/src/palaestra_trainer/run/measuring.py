"""Evaluate a saved model on the evaluating simulators of a configuration."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

from palaestra_protocol.pod.terms import Role
from palaestra_trainer import algorithms, checkpoint
from palaestra_trainer.configuration import Configuration
from palaestra_trainer.episodes.evaluation import evaluate_on_all
from palaestra_trainer.episodes.seeds import episode_seeds
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.run.training import MakeMembers, use_threads
from palaestra_trainer.run_directory import RunDirectory
from palaestra_trainer.simulators.fleet import Fleet
from palaestra_trainer.simulators.member import NullWatcher


def measure(
    configuration: Configuration,
    model: Path,
    make_members: MakeMembers,
    *,
    episodes: int,
    stream: str,
) -> dict[str, Any]:
    """Return the evaluation of a run directory's model, in the first `episodes` episodes of a seed stream.

    Only the configuration's evaluating simulators are created and started.

    Raises:
        ConfigurationError: the model is missing or does not fit, or no simulator evaluates.
        FaultBudgetSpent: a simulator broke more often than its budget allows.
    """
    evaluating = configuration.with_role(Role.EVALUATE)
    if not evaluating:
        raise ConfigurationError("simulators: none has role Evaluate; give one of them that role")
    if not model.exists():
        raise ConfigurationError(f"{model}: does not exist; train first, or give another run directory")
    use_threads()
    only = configuration.model_copy(update={"simulators": evaluating})
    with ExitStack() as stack:
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
    return evaluation.summary() | {
        "seeds": stream,
        "run_seed": configuration.seed,
        "seconds": round(evaluation.seconds, 2),
    }
