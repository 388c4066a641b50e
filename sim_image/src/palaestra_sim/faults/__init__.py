"""Injected faults: a stub that fails like a simulator, to test training code.

- `kinds`: the faults, as data
- `language`: from `crash:probability=0.0005` to data, or to a sentence about the mistake
- `options`: the faults from the command line and the environment
- `schedule`, pure: the faults of the k-th step, reset, call or start of a life
- `course`, pure: the fate of each request and message, from counts and the schedule
- `damage`, pure: wrong messages and answers, as bytes
- `survey`: the paths that a world serves, so that a misspelt one is noticed
- `wire`, the edge: a ROS node whose traffic the course decides about
- `effects`, the edge: signals, memory, the end

A stub without faults has the plain node, and nothing of this package in its way.
"""

from palaestra_sim.faults.fault_state import FaultState
from palaestra_sim.faults.faulty_node import Failing, FaultyNode
from palaestra_sim.faults.known_paths import begin
from palaestra_sim.faults.options import add_options, read_options
from palaestra_sim.faults.parser import FaultError
from palaestra_sim.faults.process_faults import ProcessFaults

__all__ = [
    "Failing",
    "FaultError",
    "FaultState",
    "FaultyNode",
    "ProcessFaults",
    "add_options",
    "begin",
    "read_options",
]
