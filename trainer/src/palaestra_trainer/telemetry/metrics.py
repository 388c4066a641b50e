"""Export the state of a run as Prometheus metrics.

Nothing is counted here: each scrape reads `Progress`, so that /metrics and /status cannot differ. Every
family is always present, and has no value while its value is unknown.
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
from palaestra_trainer import families
from palaestra_trainer.configuration import Configuration
from palaestra_trainer.telemetry.figures import Figures
from palaestra_trainer.telemetry.progress import Counters, Progress

# For each value of the label, the name under which Stable-Baselines3 logs it.
LOSSES = MappingProxyType({name: f"train/{name}" for name in families.LOSSES})
MEASURES = MappingProxyType(
    {"exploration_rate": "rollout/exploration_rate", "ent_coef": "train/ent_coef", "std": "train/std"}
)
LEARNING_RATE = "train/learning_rate"


def constants(configuration: Configuration) -> dict[Family, Values]:
    """Return the metrics that do not change during a run."""
    return {
        families.CHECKPOINT_INTERVAL: _one(configuration.checkpoint.every_steps),
        families.STALL_DEADLINE: _one(configuration.stall_deadline_seconds),
    }


def registry(progress: Progress, known: Mapping[Family, Values] = MappingProxyType({})) -> CollectorRegistry:
    """Return a new registry with the metrics of a run and of this process.

    Args:
        progress: state of the run.
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
            families.IDLE: _one(progress.idle_s()),
            families.FAULTS: progress.faults_by_kind(),
            families.RESTARTS: progress.restarts_by_cause(),
            families.BUILD: {(version("palaestra-trainer"),): 1},
        }
        for family in families.FAMILIES:
            yield family.metric(values.get(family, {}))


def _steps(status: TrainerStatus, counters: Counters) -> dict[Family, Values]:
    checkpoint = status.last_checkpoint
    return {
        families.STEPS: _one(status.step),
        families.TARGET_STEPS: _one(status.target),
        families.STEPS_PER_SECOND: _one(status.steps_per_second),
        families.STEPS_LOST: _one(counters.steps_lost),
        families.EXTRA_STEPS: _one(counters.extra_steps),
        families.EPISODES: _one(counters.episodes),
        families.SECONDS: {(cause,): seconds for cause, seconds in counters.goodput.items()},
        families.CHECKPOINT_STEPS: _one(checkpoint.step if checkpoint else None),
        families.SIMULATORS: _by_state(status.simulators),
    }


def _episodes(figures: Figures, returns: Sequence[float]) -> dict[Family, Values]:
    successes = tuple(figures.successes)
    return {
        families.RETURN: {(): figures.returns},
        families.LENGTH: {(): figures.lengths},
        families.RETURN_MEAN: _one(fmean(returns) if returns else None),
        families.RETURN_QUANTILE: _quantiles(returns),
        families.SUCCESS: _one(fmean(successes) if successes else None),
    }


def _evaluations(figures: Figures) -> dict[Family, Values]:
    last = figures.evaluation
    return {
        families.EVALUATIONS: _one(figures.evaluations),
        families.EVALUATION_SUCCESS: _one(last.success_rate if last else None),
        families.EVALUATION_BOUND: _bounds(last.success_interval if last else None),
        families.EVALUATION_EPISODES: _one(len(last.episodes) if last else None),
        families.EVALUATION_RETURN: _one(last.mean_return if last else None),
        families.EVALUATION_LENGTH: _one(last.mean_length if last else None),
    }


def _bounds(interval: SuccessInterval | None) -> Values:
    return {} if interval is None else {("low",): interval.low, ("high",): interval.high}


def _learning(logged: Mapping[str, float]) -> dict[Family, Values]:
    return {
        families.LOSS: _logged(logged, LOSSES),
        families.EXPLORATION: _logged(logged, MEASURES),
        families.LEARNING_RATE: _one(logged.get(LEARNING_RATE)),
    }


def _checkpoints(figures: Figures) -> dict[Family, Values]:
    return {
        families.CHECKPOINT_TIME: _one(figures.saved_at),
        families.CHECKPOINT_DURATION: {(): figures.saves},
        families.CHECKPOINT_SIZE: _one(figures.saved_bytes),
        families.CHECKPOINT_FAILURES: _one(figures.saves_refused),
    }


def _simulators(figures: Figures) -> dict[Family, Values]:
    meters = figures.meters
    simulated = {name: meter.simulated_s for name, meter in meters.items()}
    return {
        families.RESETS: {(name,): meter.resets for name, meter in meters.items()},
        families.STEP_DURATION: {(name,): meter.steps for name, meter in meters.items()},
        families.BUDGET: {(name,): meter.budget_spent for name, meter in meters.items()},
        families.SIMULATED: {(name,): it for name, it in simulated.items() if it is not None},
    }


def _one(value: float | None) -> Values:
    """Return the value of a family without labels; None: unknown."""
    return {} if value is None else {(): value}


def _logged(logged: Mapping[str, float], names: Mapping[str, str]) -> Values:
    return {(label,): float(logged[name]) for label, name in names.items() if name in logged}


def _quantiles(values: Sequence[float]) -> Values:
    """Return the value nearest to each of `QUANTILES`."""
    ordered = sorted(values)
    last = len(ordered) - 1
    return {(f"{share:g}",): ordered[round(share * last)] for share in families.QUANTILES if ordered}


def _by_state(simulators: Sequence[SimulatorStatus]) -> Values:
    counted = Counter(
        (simulator.role, families.GIVEN_UP if simulator.given_up else simulator.state)
        for simulator in simulators
    )
    return {(role, state): counted[role, state] for role, state in families.SIMULATORS.combinations()}
