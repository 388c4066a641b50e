"""What /metrics says, read off the simulators at the moment of the question."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from importlib.metadata import version

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from palaestra_sim.protocol.control import SidecarState
from palaestra_sim.sidecar.preparation import SLOTS
from palaestra_sim.sidecar.simulator import Simulator

_PREFIX = "palaestra_simulator"


def registry(simulators: Sequence[Simulator]) -> CollectorRegistry:
    """Return a registry with the metrics of these simulators and nothing else."""
    own = CollectorRegistry()
    own.register(SimulatorCollector(simulators))
    return own


class SimulatorCollector(Collector):
    """Makes the metrics from the simulators' states; with a label `slot` where there are two."""

    def __init__(self, simulators: Sequence[Simulator]) -> None:
        self._label = ["slot"] if len(simulators) > 1 else []
        self._simulators = [
            ([slot] if self._label else [], simulator)
            for slot, simulator in zip(SLOTS, simulators, strict=False)
        ]

    def collect(self) -> Iterator[Metric]:
        """Yield every metric, each with all of its labels, so that none appears late."""
        yield self._gauge("up", "1 if the simulator's process runs.", lambda it: it.state.pid is not None)
        starts = CounterMetricFamily(
            f"{_PREFIX}_starts", "How often the simulator was started.", labels=self._label
        )
        faults = CounterMetricFamily(
            f"{_PREFIX}_faults",
            "Ends of the simulator that nobody had asked for.",
            labels=[*self._label, "kind"],
        )
        states = GaugeMetricFamily(
            f"{_PREFIX}_state", "1 for the state that the simulator is in.", labels=[*self._label, "state"]
        )
        for slot, simulator in self._simulators:
            now = simulator.state
            starts.add_metric(slot, now.starts)
            _add(faults, slot, simulator.faults)
            _add(states, slot, {state.value: now.state is state for state in SidecarState})
        yield from (starts, faults, states)
        yield self._gauge("rss_bytes", "Memory of its processes.", Simulator.resident_bytes)
        build = GaugeMetricFamily("palaestra_build_info", "Which release this is.", labels=["version"])
        build.add_metric([version("palaestra-sim")], 1)
        yield build

    def _gauge(self, name: str, help_text: str, value: Callable[[Simulator], float]) -> GaugeMetricFamily:
        gauge = GaugeMetricFamily(f"{_PREFIX}_{name}", help_text, labels=self._label)
        for slot, simulator in self._simulators:
            gauge.add_metric(slot, value(simulator))
        return gauge


def _add(
    family: CounterMetricFamily | GaugeMetricFamily, slot: Sequence[str], values: Mapping[str, float]
) -> None:
    """Add a value for each value of the last label."""
    for label, value in values.items():
        family.add_metric([*slot, label], value)
