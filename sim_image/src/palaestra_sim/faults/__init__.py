"""Injected faults: a simulator imitates failures of real simulators, so that users can test training code.

- `kinds`: the kinds of faults, as data
- `parser`: parses a description such as `crash:probability=0.0005`
- `options`: reads the faults from the command line and the environment
- `schedule`, pure: decides which faults occur at the k-th step, reset, call or start of a process
- `fault_state`, pure: decides which faults affect each request and message
- `corruption`, pure: changes the bytes of messages and responses
- `known_paths`: lists the paths that a world serves, so that a misspelled path is an error
- `faulty_node`, with I/O: a ROS node that drops, delays or changes its requests and messages
- `process_faults`, with I/O: sends signals to the process, allocates memory, or exits

A simulator without faults uses the plain `RosNode`, so this package does not slow it down.
"""

from palaestra_sim.faults.fault_state import FaultState
from palaestra_sim.faults.faulty_node import Failing, FaultyNode
from palaestra_sim.faults.known_paths import begin, survey, survey_robot
from palaestra_sim.faults.options import Ordered, add_options, read_environment, read_options
from palaestra_sim.faults.parser import FaultError
from palaestra_sim.faults.process_faults import ProcessFaults

__all__ = [
    "Failing",
    "FaultError",
    "FaultState",
    "FaultyNode",
    "Ordered",
    "ProcessFaults",
    "add_options",
    "begin",
    "read_environment",
    "read_options",
    "survey",
    "survey_robot",
]
