"""The declarations of a sidecar's metrics; `palaestra_sim.sidecar.metrics` supplies the values.

These metrics describe the simulator's process. The trainer exports metrics of the episodes. Prometheus adds
the labels for job and simulator.
"""

from palaestra_protocol.control import SidecarState
from palaestra_protocol.metrics import Family, Label, counter, gauge
from palaestra_sim.sidecar.simulator import FAULT_KINDS
from palaestra_sim.sidecar.world_files import SLOTS

SLOT = Label(name="slot", values=SLOTS, bound="simulator of the sidecar")
STATE = Label(name="state", values=tuple(SidecarState))
KIND = Label(name="kind", values=FAULT_KINDS)

UP = gauge("palaestra_simulator_up", "1 if the simulator's process runs, else 0.", SLOT)
STATES = gauge(
    "palaestra_simulator_state",
    "1 for the current state of the simulator, 0 for the other states.",
    SLOT,
    STATE,
)
STARTS = counter("palaestra_simulator_starts_total", "Number of starts of the simulator.", SLOT)
EXITS = counter(
    "palaestra_simulator_unexpected_exits_total",
    "Unexpected ends of the simulator's process: with an exit code, by a signal, or unknown.",
    SLOT,
    KIND,
)
MEMORY = gauge("palaestra_simulator_rss_bytes", "Memory of the simulator's processes.", SLOT)
PROCESSOR = counter(
    "palaestra_simulator_cpu_seconds_total",
    "Processor time of the simulator's processes since its last start.",
    SLOT,
)
BUILD = gauge(
    "palaestra_sidecar_build_info",
    "Always 1; the label is the release.",
    Label(name="version", bound="release"),
)

FAMILIES: tuple[Family, ...] = (UP, STATES, STARTS, EXITS, MEMORY, PROCESSOR, BUILD)
