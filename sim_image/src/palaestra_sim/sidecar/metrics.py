"""The values in /metrics; they are read from the simulators at each request."""

from collections.abc import Iterator, Mapping, Sequence
from importlib.metadata import version

from prometheus_client import CollectorRegistry, ProcessCollector
from prometheus_client.metrics_core import Metric
from prometheus_client.registry import Collector

from palaestra_protocol.control import SidecarState
from palaestra_protocol.metrics import Family, Values
from palaestra_sim.sidecar import metric_definitions
from palaestra_sim.sidecar.simulator import SupervisedSimulator
from palaestra_sim.sidecar.world_files import SLOTS


def registry(simulators: Sequence[SupervisedSimulator]) -> CollectorRegistry:
    """Return a registry with the metrics of these simulators, and of this process."""
    own = CollectorRegistry()
    own.register(_Simulators(simulators))
    ProcessCollector(registry=own)
    return own


class _Simulators(Collector):
    """Creates the metrics of the simulators; each series exists from the first scrape, even at 0."""

    def __init__(self, simulators: Sequence[SupervisedSimulator]) -> None:
        self._simulators = dict(zip(SLOTS, simulators, strict=False))

    def collect(self) -> Iterator[Metric]:
        values = self._values()
        for family in metric_definitions.FAMILIES:
            yield family.metric(values[family])

    def _values(self) -> Mapping[Family, Values]:
        them = self._simulators.items()
        used = {slot: simulator.usage() for slot, simulator in them}
        states = {slot: simulator.state for slot, simulator in them}  # read once, because states change
        return {
            metric_definitions.UP: {(slot,): state.pid is not None for slot, state in states.items()},
            metric_definitions.STATES: {
                (slot, state): it.state is state for slot, it in states.items() for state in SidecarState
            },
            metric_definitions.STARTS: {(slot,): state.starts for slot, state in states.items()},
            metric_definitions.EXITS: {
                (slot, kind): times for slot, simulator in them for kind, times in simulator.faults.items()
            },
            metric_definitions.MEMORY: {(slot,): usage.rss_bytes for slot, usage in used.items()},
            metric_definitions.PROCESSOR: {(slot,): usage.cpu_s for slot, usage in used.items()},
            metric_definitions.BUILD: {(version("palaestra-sim"),): 1},
        }
