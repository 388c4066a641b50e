"""Export the state of a run as Prometheus metrics.

This module does not count. Each scrape reads `Progress`, so /metrics and /status cannot differ. Every family
is always exported, but without samples while its value is unknown.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version
from statistics import fmean
from types import MappingProxyType

from prometheus_client import CollectorRegistry, ProcessCollector
from prometheus_client.core import Metric
from prometheus_client.registry import Collector

from palaestra_protocol.metrics import Family, Values
from palaestra_protocol.pod.status import SimulatorStatus, SuccessInterval, TrainerStatus
from palaestra_trainer.job.configuration import Configuration
from palaestra_trainer.run.telemetry import metric_definitions
from palaestra_trainer.run.telemetry.metric_values import MetricValues
from palaestra_trainer.run.telemetry.progress import Counters, Progress

# The values of the labels `loss` and `measure`, each with its name in Stable-Baselines3's log.
LOSSES = MappingProxyType({name: f"train/{name}" for name in metric_definitions.LOSSES})
MEASURES = MappingProxyType(
    {"exploration_rate": "rollout/exploration_rate", "ent_coef": "train/ent_coef", "std": "train/std"}
)
LEARNING_RATE = "train/learning_rate"


def constants(configuration: Configuration) -> dict[Family, Values]:
    """Return the metrics that do not change during a run."""
    return {
        metric_definitions.CHECKPOINT_INTERVAL: _one(configuration.checkpoint.every_steps),
        metric_definitions.STALL_DEADLINE: _one(configuration.stall_deadline_seconds),
    }


def registry(progress: Progress, known: Mapping[Family, Values] = MappingProxyType({})) -> CollectorRegistry:
    """Return a new registry with the metrics of a run and of this process.

    Args:
        progress: progress of the run.
        known: the result of `constants`.
    """
    made = CollectorRegistry()
    made.register(_RunCollector(progress, known))
    ProcessCollector(registry=made)
    return made


class _RunCollector(Collector):
    def __init__(self, progress: Progress, known: Mapping[Family, Values]) -> None:
        self._progress = progress
        self._known = known

    def collect(self) -> Iterator[Metric]:
        progress = self._progress
        values: dict[Family, Values] = {
            **self._known,
            **_steps(progress.status(), progress.counted()),
            **_episodes(progress.figures, progress.returns()),
            **_evaluations(progress.figures),
            **_learning(progress.figures.logged),
            **_checkpoints(progress.figures),
            **_simulators(progress.figures),
            metric_definitions.IDLE: _one(progress.idle_s()),
            metric_definitions.FAULTS: progress.faults_by_kind(),
            metric_definitions.RESTARTS: progress.restarts_by_cause(),
            metric_definitions.BUILD: {(version("palaestra-trainer"),): 1},
        }
        for family in metric_definitions.FAMILIES:
            yield family.metric(values.get(family, {}))


def _steps(status: TrainerStatus, counters: Counters) -> dict[Family, Values]:
    checkpoint = status.last_checkpoint
    return {
        metric_definitions.STEPS: _one(status.step),
        metric_definitions.TARGET_STEPS: _one(status.target),
        metric_definitions.STEPS_PER_SECOND: _one(status.steps_per_second),
        metric_definitions.STEPS_LOST: _one(counters.steps_lost),
        metric_definitions.EXTRA_STEPS: _one(counters.extra_steps),
        metric_definitions.EPISODES: _one(counters.episodes),
        metric_definitions.SECONDS: {(cause,): seconds for cause, seconds in counters.goodput.items()},
        metric_definitions.CHECKPOINT_STEPS: _one(checkpoint.step if checkpoint else None),
        metric_definitions.SIMULATORS: _by_state(status.simulators),
    }


def _episodes(figures: MetricValues, returns: Sequence[float]) -> dict[Family, Values]:
    successes = tuple(figures.successes)
    return {
        metric_definitions.RETURN: {(): figures.returns},
        metric_definitions.LENGTH: {(): figures.lengths},
        metric_definitions.RETURN_MEAN: _one(fmean(returns) if returns else None),
        metric_definitions.RETURN_QUANTILE: _quantiles(returns),
        metric_definitions.SUCCESS: _one(fmean(successes) if successes else None),
    }


def _evaluations(figures: MetricValues) -> dict[Family, Values]:
    last = figures.evaluation
    return {
        metric_definitions.EVALUATIONS: _one(figures.evaluations),
        metric_definitions.EVALUATION_SUCCESS: _one(last.success_rate if last else None),
        metric_definitions.EVALUATION_BOUND: _bounds(last.success_interval if last else None),
        metric_definitions.EVALUATION_EPISODES: _one(len(last.episodes) if last else None),
        metric_definitions.EVALUATION_RETURN: _one(last.mean_return if last else None),
        metric_definitions.EVALUATION_LENGTH: _one(last.mean_length if last else None),
    }


def _bounds(interval: SuccessInterval | None) -> Values:
    return {} if interval is None else {("low",): interval.low, ("high",): interval.high}


def _learning(logged: Mapping[str, float]) -> dict[Family, Values]:
    return {
        metric_definitions.LOSS: _logged(logged, LOSSES),
        metric_definitions.EXPLORATION: _logged(logged, MEASURES),
        metric_definitions.LEARNING_RATE: _one(logged.get(LEARNING_RATE)),
    }


def _checkpoints(figures: MetricValues) -> dict[Family, Values]:
    return {
        metric_definitions.CHECKPOINT_TIME: _one(figures.saved_at),
        metric_definitions.CHECKPOINT_DURATION: {(): figures.saves},
        metric_definitions.CHECKPOINT_SIZE: _one(figures.saved_bytes),
        metric_definitions.CHECKPOINT_FAILURES: _one(figures.saves_refused),
    }


def _simulators(figures: MetricValues) -> dict[Family, Values]:
    meters = figures.meters
    simulated = {name: meter.simulated_s for name, meter in meters.items()}
    return {
        metric_definitions.RESETS: {(name,): meter.resets for name, meter in meters.items()},
        metric_definitions.STEP_DURATION: {(name,): meter.steps for name, meter in meters.items()},
        metric_definitions.BUDGET: {(name,): meter.budget_spent for name, meter in meters.items()},
        metric_definitions.SIMULATED: {(name,): it for name, it in simulated.items() if it is not None},
    }


def _one(value: float | None) -> Values:
    """Return the value of a family without labels; empty for None, an unknown value."""
    return {} if value is None else {(): value}


def _logged(logged: Mapping[str, float], names: Mapping[str, str]) -> Values:
    return {(label,): float(logged[name]) for label, name in names.items() if name in logged}


def _quantiles(values: Sequence[float]) -> Values:
    """Return for each of `QUANTILES` the nearest value."""
    ordered = sorted(values)
    last = len(ordered) - 1
    return {
        (f"{share:g}",): ordered[round(share * last)] for share in metric_definitions.QUANTILES if ordered
    }


def _by_state(simulators: Sequence[SimulatorStatus]) -> Values:
    counted = Counter(
        (simulator.role, metric_definitions.GIVEN_UP if simulator.given_up else simulator.state)
        for simulator in simulators
    )
    return {
        (role, state): counted[role, state] for role, state in metric_definitions.SIMULATORS.combinations()
    }
