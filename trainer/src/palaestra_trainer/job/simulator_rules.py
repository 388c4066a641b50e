"""Refuse simulators of a configuration that do not fit together; `palaestra.api` refuses them too."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palaestra_protocol.pod.enums import Role

if TYPE_CHECKING:
    from palaestra_trainer.job.configuration import Configuration


def simulator_mistake(configuration: Configuration) -> str:
    """Return the first mistake of the simulators, with field, fact and remedy; "" without one."""
    names = [simulator.name for simulator in configuration.simulators]
    if twice := sorted({name for name in names if names.count(name) > 1}):
        return f"simulators: the name {twice[0]} is used twice; make names unique"
    if any(simulator.batch for simulator in configuration.simulators):
        return _mistake_of_copies(configuration)
    if not configuration.with_role(Role.COLLECT):
        return "simulators: none has role Collect; give one of them that role"
    return ""


def _mistake_of_copies(configuration: Configuration) -> str:
    """Return the first mistake of a configuration in which a simulator has copies of its world."""
    [simulator, *others] = [simulator for simulator in configuration.simulators if simulator.batch]
    if simulator.role is not Role.COLLECT or others:
        return "simulators: batch is for one simulator with role Collect; remove it from the others"
    if len(configuration.with_role(Role.COLLECT)) != 1:
        return "simulators: batch needs one collecting simulator; use a larger batch instead"
    if simulator.driver != "mujoco" or simulator.standby or simulator.reset or simulator.recycle:
        return "simulators: batch needs driver mujoco, without standby, reset and recycle; remove them"
    if configuration.command is not None:
        return "simulators: batch is for the built-in training loop; remove command or batch"
    if configuration.collection == "Asynchronous":
        return "collection: Asynchronous is for several simulators; remove collection or batch"
    return ""
