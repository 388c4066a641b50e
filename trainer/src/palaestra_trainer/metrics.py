"""The run in Prometheus' words.

Nothing is counted here: at each scrape the numbers are read from `Progress`,
so that /metrics and /status can't differ.
"""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector

from palaestra_sim.protocol.status import FaultKind
from palaestra_trainer.progress import Progress


class _RunCollector(Collector):
    def __init__(self, progress: Progress) -> None:
        self._progress = progress

    def collect(self) -> Iterator[Metric]:
        status, counters = self._progress.status(), self._progress.counted()
        gauges = {
            "palaestra_trainer_steps": ("Valid environment steps so far.", status.step),
            "palaestra_trainer_target_steps": ("Steps at which the run ends.", status.target),
            "palaestra_trainer_steps_per_second": ("Lately.", status.steps_per_second),
            "palaestra_trainer_episode_return_mean": (
                "Mean return of recent training episodes.",
                status.mean_return,
            ),
            "palaestra_trainer_success_ratio": (
                "Share of successful episodes in the last evaluation.",
                status.success_rate,
            ),
            "palaestra_trainer_checkpoint_steps": (
                "Step of the newest checkpoint.",
                status.last_checkpoint.step if status.last_checkpoint else None,
            ),
            "palaestra_trainer_idle_seconds": (
                "Since the last environment step.",
                self._progress.idle_s(),
            ),
        }
        for name, (text, value) in gauges.items():
            if value is not None:
                yield GaugeMetricFamily(name, text, value)
        totals = {
            "palaestra_trainer_episodes": ("Training episodes without a fault.", counters.episodes),
            "palaestra_simulator_restarts": ("Restarts after a fault.", counters.restarts),
            "palaestra_simulator_recycles": ("Restarts of healthy ones.", counters.recycled),
            "palaestra_simulators_given_up": ("Those the run went on without.", counters.given_up),
            "palaestra_simulator_extra_steps": ("Steps for a late message.", counters.extra_steps),
            "palaestra_trainer_steps_lost": ("Valid steps played in vain.", counters.steps_lost),
        }
        for name, (text, value) in totals.items():
            yield CounterMetricFamily(name, text, value)
        faults = CounterMetricFamily("palaestra_simulator_faults", "By kind.", labels=["kind"])
        for kind in FaultKind:
            faults.add_metric([kind], counters.faults[kind])
        yield faults
        spent = CounterMetricFamily("palaestra_trainer_seconds", "Wall clock by cause.", labels=["cause"])
        for cause, seconds in counters.goodput.items():
            spent.add_metric([cause], seconds)
        yield spent


def registry(progress: Progress) -> CollectorRegistry:
    """Return a registry of its own with everything that is known of a run."""
    made = CollectorRegistry()
    made.register(_RunCollector(progress))
    return made
