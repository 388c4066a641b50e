"""What /metrics says, read off the simulator at the moment of the question."""

from collections.abc import Iterator
from importlib.metadata import version

from prometheus_client import CollectorRegistry
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from palaestra_sim.protocol.control import SidecarState
from palaestra_sim.sidecar.simulator import Simulator

_PREFIX = "palaestra_simulator"


def registry(simulator: Simulator) -> CollectorRegistry:
    """Return a registry with this simulator's metrics and nothing else."""
    own = CollectorRegistry()
    own.register(SimulatorCollector(simulator))
    return own


class SimulatorCollector(Collector):
    """Makes the metrics from the simulator's state."""

    def __init__(self, simulator: Simulator) -> None:
        self._simulator = simulator

    def collect(self) -> Iterator[Metric]:
        """Yield every metric, each with all of its labels, so that none appears late."""
        now = self._simulator.state
        yield _gauge("up", "1 if the simulator's process runs.", now.pid is not None)
        yield CounterMetricFamily(
            f"{_PREFIX}_starts", "How often the simulator was started.", value=now.starts
        )
        faults = CounterMetricFamily(
            f"{_PREFIX}_faults", "Ends of the simulator that nobody had asked for.", labels=["kind"]
        )
        for kind, count in self._simulator.faults.items():
            faults.add_metric([kind], count)
        yield faults
        states = GaugeMetricFamily(
            f"{_PREFIX}_state", "1 for the state that the simulator is in.", labels=["state"]
        )
        for state in SidecarState:
            states.add_metric([state.value], now.state is state)
        yield states
        yield _gauge("rss_bytes", "Memory of its processes.", self._simulator.resident_bytes())
        build = GaugeMetricFamily("palaestra_build_info", "Which release this is.", labels=["version"])
        build.add_metric([version("palaestra-sim")], 1)
        yield build


def _gauge(name: str, help_text: str, value: float) -> GaugeMetricFamily:
    return GaugeMetricFamily(f"{_PREFIX}_{name}", help_text, value=value)
