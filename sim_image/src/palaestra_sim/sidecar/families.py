"""Every metric of a sidecar, by name; `palaestra_sim.sidecar.metrics` reads their values.

They are about the simulator's process. How it plays is told by the trainer, who plays in it. Which
simulator of which job this is is said by whoever scrapes, not here.
"""

from palaestra_sim.protocol.control import SidecarState
from palaestra_sim.protocol.metrics import Family, Kind, Label
from palaestra_sim.sidecar.preparation import SLOTS
from palaestra_sim.sidecar.simulator import FAULT_KINDS

SLOT = Label(name="slot", values=SLOTS, bound="simulator of the sidecar")
STATE = Label(name="state", values=tuple(SidecarState))
KIND = Label(name="kind", values=FAULT_KINDS)

UP = Family(
    name="palaestra_simulator_up",
    kind=Kind.GAUGE,
    meaning="1 if the simulator's process runs.",
    labels=(SLOT,),
)
STATES = Family(
    name="palaestra_simulator_state",
    kind=Kind.GAUGE,
    meaning="1 for the state that the simulator is in.",
    labels=(SLOT, STATE),
)
STARTS = Family(
    name="palaestra_simulator_starts_total",
    kind=Kind.COUNTER,
    meaning="How often the simulator was started.",
    labels=(SLOT,),
)
EXITS = Family(
    name="palaestra_simulator_unexpected_exits_total",
    kind=Kind.COUNTER,
    meaning="Ends of the simulator that nobody had asked for: with a code, by a signal, or nobody knows how.",
    labels=(SLOT, KIND),
)
MEMORY = Family(
    name="palaestra_simulator_rss_bytes",
    kind=Kind.GAUGE,
    meaning="Memory of its processes.",
    labels=(SLOT,),
)
PROCESSOR = Family(
    name="palaestra_simulator_cpu_seconds_total",
    kind=Kind.COUNTER,
    meaning="Processor time of its processes since its last start.",
    labels=(SLOT,),
)
BUILD = Family(
    name="palaestra_sidecar_build_info",
    kind=Kind.GAUGE,
    meaning="Always 1; the label tells the release.",
    labels=(Label(name="version", bound="release"),),
)

FAMILIES: tuple[Family, ...] = (UP, STATES, STARTS, EXITS, MEMORY, PROCESSOR, BUILD)
