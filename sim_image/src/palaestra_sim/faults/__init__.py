"""Injected faults: the stub fails as a simulator does, to test training code.

- `kinds`: the faults, as data
- `parser`: parses `crash:probability=0.0005`, or raises an error with the mistake
- `options`: the faults from the command line and the environment
- `schedule`, pure: the faults of the k-th step, reset, call or start of a life
- `fault_state`, pure: the fate of each request and message, from counts and the schedule
- `corruption`, pure: damaged messages and responses, as bytes
- `known_paths`: the paths that a world serves, so that a misspelled path is an error
- `faulty_node`, with I/O: a ROS node whose traffic passes through the fault state
- `process_faults`, with I/O: signals, memory, exits

A stub without faults uses the plain node, so this package costs it nothing.
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
