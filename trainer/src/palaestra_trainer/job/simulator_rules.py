"""Refuse simulators of a configuration that do not fit together; `palaestra.api` refuses them too."""

from __future__ import annotations

from collections.abc import Sequence

from palaestra_protocol.pod.enums import Role
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration


def simulator_mistake(
    simulators: Sequence[SimulatorConfiguration], *, own_program: bool, asynchronous: bool
) -> str:
    """Return the first mistake of the simulators, with field, fact and remedy; "" without one.

    Args:
        simulators: all simulators of the configuration.
        own_program: whether the user's own program replaces the built-in training loop.
        asynchronous: whether a vector step returns as soon as one simulator has a row.
    """
    names = [simulator.name for simulator in simulators]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        return f"simulators: the name {twice[0]} is used twice; make names unique"
    if any(simulator.batch for simulator in simulators):
        return _mistake_of_copies(simulators, own_program=own_program, asynchronous=asynchronous)
    if not _collecting(simulators):
        return "simulators: none has role Collect; give one of them that role"
    return ""


def _mistake_of_copies(
    simulators: Sequence[SimulatorConfiguration], *, own_program: bool, asynchronous: bool
) -> str:
    """Return the first mistake of a configuration in which a simulator has copies of its world."""
    [simulator, *others] = [simulator for simulator in simulators if simulator.batch]
    if simulator.role is not Role.COLLECT or others:
        return "simulators: batch is for one simulator with role Collect; remove it from the others"
    if _collecting(simulators) != 1:
        return "simulators: batch needs one collecting simulator; use a larger batch instead"
    if simulator.driver != "mujoco" or simulator.standby or simulator.reset or simulator.recycle:
        return "simulators: batch needs driver mujoco, without standby, reset and recycle; remove them"
    if own_program:
        return "simulators: batch is for the built-in training loop; remove command or batch"
    if asynchronous:
        return "collection: Asynchronous is for several simulators; remove collection or batch"
    return ""


def _collecting(simulators: Sequence[SimulatorConfiguration]) -> int:
    return sum(simulator.role is Role.COLLECT for simulator in simulators)
