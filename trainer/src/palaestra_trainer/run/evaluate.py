"""Evaluate a saved model on the evaluating simulators of a configuration."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import structlog

from palaestra_protocol.pod.enums import ExitCode, Role
from palaestra_trainer import algorithms
from palaestra_trainer.episodes.evaluation import ActingPolicy, evaluate_on_all
from palaestra_trainer.episodes.seeds import episode_seeds
from palaestra_trainer.episodes.vec_env import SimulatorsVecEnv
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.job.run_directory import RunDirectory
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.run import checkpoint
from palaestra_trainer.run.attempt import STOPPED_S, MakeMembers, use_threads
from palaestra_trainer.run.exit import leave_after
from palaestra_trainer.run.versions import SIMULATING, versions
from palaestra_trainer.simulators.drivers import in_driver
from palaestra_trainer.simulators.fleet import Fleet
from palaestra_trainer.simulators.interface import NullWatcher
from palaestra_trainer.simulators.restarter import Restarter
from palaestra_trainer.waiting.check import Check, go_on

log = structlog.get_logger(__name__)


def _nobody(result: dict[str, Any]) -> None:
    """Ignore a result."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Playing:
    """The policy of a run, and the started simulators in which it plays."""

    policy: ActingPolicy
    restarters: Sequence[Restarter]


@contextmanager
def playing(
    configuration: Configuration, model: Path, make_members: MakeMembers, check: Check = go_on
) -> Iterator[Playing]:
    """Start simulators; yield them and the policy of a model.zip; stop the simulators at the end.

    Args:
        configuration: the configuration of the run; its simulators are started, and all must evaluate.
        model: the model.zip of the run directory.
        make_members: a function that creates the simulators.
        check: called while the simulators start; it raises to cancel the start.

    Raises:
        ConfigurationError: the model is missing, or does not fit the configuration.
        FaultBudgetSpent: a simulator failed more often than its restart budget allows.
    """
    if not model.exists():
        raise ConfigurationError(f"{model}: does not exist; train first, or give another run directory")
    use_threads()
    with ExitStack() as stack:
        fleet = Fleet(configuration, make_members(configuration), NullWatcher())
        stack.callback(fleet.stop)
        begun = algorithms.begun_with(configuration, RunDirectory(model.parent))
        task = fleet.evaluating[0].member.env
        algorithms.refuse_without_masks(begun, task, configuration.environment.id)
        fleet.start(check)
        env = SimulatorsVecEnv(fleet.evaluating[:1], configuration.seed)
        trained = algorithms.make_model(begun, env, configuration.seed, configuration.device)
        checkpoint.load_tensors(model, trained)
        yield Playing(policy=algorithms.ModelPolicy(trained), restarters=fleet.evaluating)


def measure(
    configuration: Configuration,
    model: Path,
    make_members: MakeMembers,
    *,
    episodes: int,
    stream: str,
    report: Callable[[dict[str, Any]], object] = _nobody,
) -> dict[str, Any]:
    """Evaluate the model of a run directory in the first `episodes` episodes of a seed stream.

    Only the evaluating simulators of the configuration are started. If the configuration has no evaluating
    simulators, the first collecting simulator is started.

    Args:
        configuration: the configuration of the run.
        model: the model.zip of the run directory.
        make_members: a function that creates the simulators.
        episodes: number of episodes to play.
        stream: name of the seed stream.
        report: called with the result before the simulators are stopped. If they do not stop within a minute,
            the process ends.

    Raises:
        The same errors as `playing`.
    """
    only = configuration.model_copy(update={"simulators": _warned(configuration)})
    with ExitStack() as last, playing(only, model, make_members) as player:
        seeds = episode_seeds(configuration.seed, stream, episodes)
        evaluation = evaluate_on_all(player.policy, player.restarters, seeds)
        interval = evaluation.success_interval
        result = evaluation.summary() | {
            "success_interval": None if interval is None else interval.to_json(),
            "simulators": sorted({each.driver for each in only.simulators}),
            "worlds": sorted({Path(each.world).name for each in only.simulators}),
            "model": hashlib.sha256(model.read_bytes()).hexdigest(),
            "versions": _simulating(),
            "seeds": stream,
            "run_seed": configuration.seed,
            "seconds": round(evaluation.seconds, 2),
        }
        report(result)
        last.callback(leave_after(STOPPED_S, ExitCode.DONE).cancel)
    return result


def in_each(
    drivers: Sequence[str],
    configuration: Configuration,
    model: Path,
    make_members: MakeMembers,
    **wanted: Any,
) -> Iterator[dict[str, Any]]:
    """Yield the results of `measure` on the same episodes in several simulator programs, one by one.

    In each result, `simulator` is the name of the program.

    Raises:
        ConfigurationError: as `measure`; also before a simulator starts, if one of the programs cannot run on
            this machine.
        FaultBudgetSpent: as `measure`.
    """
    entries = _warned(configuration)
    each = {driver: tuple(in_driver(entry, driver) for entry in entries) for driver in drivers}
    for driver, simulators in each.items():
        only = configuration.model_copy(update={"simulators": simulators})
        yield {"simulator": driver, **measure(only, model, make_members, **wanted)}


def evaluating(configuration: Configuration) -> tuple[SimulatorConfiguration, ...]:
    """Return the simulators with role Evaluate; if there are none, return the first collecting simulator."""
    if found := configuration.with_role(Role.EVALUATE):
        return found
    return (configuration.with_role(Role.COLLECT)[0].model_copy(update={"role": Role.EVALUATE}),)


def _simulating() -> dict[str, str]:
    """Return the versions of the programs on which a result depends, as far as they are installed here."""
    return {name: known for name, known in versions().items() if name in SIMULATING}


def _warned(configuration: Configuration) -> tuple[SimulatorConfiguration, ...]:
    """Return the simulators that evaluate; log a warning if a collecting simulator must evaluate."""
    found = evaluating(configuration)
    if not configuration.with_role(Role.EVALUATE):
        log.warning(
            "no simulator has role Evaluate: a collecting simulator evaluates, in its own world",
            name=found[0].name,
        )
    return found
