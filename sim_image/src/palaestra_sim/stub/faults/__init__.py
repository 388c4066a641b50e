"""Faults on demand: a stub that fails as simulators do, so that training code can be tried against it.

kinds       what can go wrong, as data
language    `crash:probability=0.0005` to data, and a sentence about what is wrong with it
schedule    PURE: which faults happen at the k-th step, reset, call or start of a life
course      PURE: what becomes of each request and message, from counts and the schedule
damage      PURE: messages and answers made wrong, as bytes
survey      which paths a world serves, so that a misspelt one is noticed
wire        the edge: a ROS node whose traffic the course decides about
effects     the edge: signals, memory, the end

Nothing of it is in the way of a stub without faults: it has the plain node, not this one.
"""

from palaestra_sim.stub.faults.course import Course
from palaestra_sim.stub.faults.effects import Effects
from palaestra_sim.stub.faults.language import FaultError
from palaestra_sim.stub.faults.options import add_options, read_options
from palaestra_sim.stub.faults.survey import begin
from palaestra_sim.stub.faults.wire import Failing, FaultyNode

__all__ = [
    "Course",
    "Effects",
    "Failing",
    "FaultError",
    "FaultyNode",
    "add_options",
    "begin",
    "read_options",
]
