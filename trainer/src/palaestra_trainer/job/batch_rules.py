"""Refuse a configuration that a simulator with copies cannot follow; `palaestra.api` refuses it too."""

from __future__ import annotations

from typing import TYPE_CHECKING

from palaestra_protocol.pod.enums import Role

if TYPE_CHECKING:
    from palaestra_trainer.job.configuration import Configuration


def batch_mistake(configuration: Configuration) -> str:
    """Return the mistake of a configuration with `batch`, with field, fact and remedy; "" without one."""
    with_batch = [simulator for simulator in configuration.simulators if simulator.batch]
    if not with_batch:
        return ""
    if any(simulator.role is not Role.COLLECT for simulator in with_batch):
        return "simulators: batch is for role Collect; remove it from the others"
    if len(configuration.with_role(Role.COLLECT)) != 1:
        return "simulators: batch needs one collecting simulator; use a larger batch instead"
    [simulator] = with_batch
    if simulator.driver != "mujoco" or simulator.standby or simulator.reset or simulator.recycle:
        return "simulators: batch needs driver mujoco, without standby, reset and recycle; remove them"
    if configuration.command is not None:
        return "simulators: batch is for the built-in training loop; remove command or batch"
    if configuration.collection == "Asynchronous":
        return "collection: Asynchronous is for several simulators; remove collection or batch"
    return ""
