"""Create the members of fault-tolerant environments from a facade, from a job, or from new simulators."""

from __future__ import annotations

import os
from collections.abc import Sequence
from contextlib import ExitStack
from functools import partial
from typing import Any

import palaestra_trainer.environments  # noqa: F401 - the import registers the shipped environments
from palaestra_protocol.pod.enums import Role
from palaestra_trainer.errors import ConfigurationError
from palaestra_trainer.job.configuration import CONFIG_VARIABLE, Configuration, Environment, load
from palaestra_trainer.job.simulator_configuration import SimulatorConfiguration
from palaestra_trainer.run.custom_program import ProgramReport, reported
from palaestra_trainer.run.fault_tolerant.env_group import EnvGroup
from palaestra_trainer.run.fault_tolerant.episode_runner import StepResult
from palaestra_trainer.run.telemetry.progress_sources import follow
from palaestra_trainer.simulators.allocation import allocate
from palaestra_trainer.simulators.configured import require_driver
from palaestra_trainer.simulators.connect import connect_members, new_simulator, robot_of
from palaestra_trainer.simulators.entry_point import own_world, role_of
from palaestra_trainer.simulators.fleet import Fleet
from palaestra_trainer.simulators.interface import Member, NullWatcher, Watcher
from palaestra_trainer.simulators.notebook_simulator import (
    NotebookMember,
    NotebookSimulator,
    offered_simulator,
)
from palaestra_trainer.simulators.restarter import Restarter


def make_players(
    environment_id: str | None, number: int | None, role_name: str, options: dict[str, Any]
) -> EnvGroup:
    """Return a group of environments of one class, each in its own running simulator.

    If this process has `Webots` facades that no environment uses, a single environment takes the simulator of
    the newest of these facades. Without such a facade, or for more than one simulator, the simulators of
    PALAESTRA_CONFIG are used. If that variable is not set, new simulators are started: stubs, or MuJoCo for
    `SeeTarget-v0`.

    Args:
        environment_id: the id of the environment; None: the id in PALAESTRA_CONFIG.
        number: number of simulators; None: the simulator of the facade, or else all simulators with the role,
            or else one new simulator.
        role_name: the role of the simulators in PALAESTRA_CONFIG.
        options: options of the environment.

    Raises:
        ConfigurationError: the environment is missing or wrong, too few simulators with the role are free, or
            MuJoCo is not installed.
        FaultBudgetSpent: a simulator did not start.
        MasterLost: no ROS master responds.
    """
    if environment_id is None and options:
        raise ConfigurationError(
            f"environment: is missing, but its options were given ({', '.join(options)}); name the "
            "environment"
        )
    wanted = None if environment_id is None else Environment(id=environment_id, options=options)
    role = role_of(role_name)
    if number is not None and number < 1:
        raise ConfigurationError(f"num_envs: {number} is not a number of environments; give 1 or more")
    configuration = load() if os.environ.get(CONFIG_VARIABLE) else None
    environment = wanted or (configuration.environment if configuration else None)
    if environment is None:
        raise ConfigurationError(
            f"environment: none was given, and {CONFIG_VARIABLE} is not set; give the id of an environment"
        )
    world, driver = own_world(environment.id)
    place = offered_simulator(world) if number in {None, 1} else None
    if place is not None:
        return _in_facade(place, environment)
    if configuration is not None:
        return _in_job(configuration.model_copy(update={"environment": environment}), number, role)
    require_driver(driver)
    return _in_own(environment, number or 1, world, driver)


def _in_facade(place: NotebookSimulator, environment: Environment) -> EnvGroup:
    with ExitStack() as undo:
        undo.callback(place.release)
        restarter = Restarter(NotebookMember(place, environment))
        undo.pop_all()
    # The program may pause the simulator after any step, so `step` must not return during a restart.
    return EnvGroup([restarter], restarter.stop, wait_for_restart=True)


def _in_job(configuration: Configuration, number: int | None, role: Role) -> EnvGroup:
    with ExitStack() as stack:
        entries = _allocated(stack, configuration, number, role)
        chosen = configuration.model_copy(update={"simulators": entries})
        members = connect_members(chosen)
        progress = reported(configuration)
        for entry in entries:
            progress.add(entry.name, role)
        follow(progress, members)
        restarters = _started(stack, chosen, members, progress)
        progress.figures.meters = {**progress.figures.meters, **{it.name: it.meter for it in restarters}}
        return EnvGroup(
            restarters,
            stack.pop_all().close,
            configuration.stall_deadline_seconds,
            played=partial(_count, progress, role),
        )


def _in_own(environment: Environment, number: int, world: str, driver: str) -> EnvGroup:
    entries = tuple(
        SimulatorConfiguration(
            name=f"collect-{index}",
            group="collect",
            index=index,
            role=Role.COLLECT,
            driver=driver,
            world=world,
        )
        for index in range(number)
    )
    configuration = Configuration(
        job="own", environment=environment, steps=1, simulators=entries, robot=robot_of(world)
    )
    with ExitStack() as stack:
        members = []
        for entry in entries:
            member, process = new_simulator(configuration, entry)
            stack.callback(process.close)
            members.append(member)
        return EnvGroup(_started(stack, configuration, members, NullWatcher()), stack.pop_all().close)


def _allocated(
    stack: ExitStack, configuration: Configuration, number: int | None, role: Role
) -> tuple[SimulatorConfiguration, ...]:
    """Reserve simulators until `stack` closes; return their entries, which require all of them to work."""
    every = max(1, len(configuration.with_role(role)))
    entries = []
    for _ in range(number or every):
        allocated = allocate(configuration, role)
        stack.callback(allocated.lock.release)
        entries.append(allocated.simulator.model_copy(update={"min_simulators": None}))
    return tuple(entries)


def _started(
    stack: ExitStack, configuration: Configuration, members: Sequence[Member], watcher: Watcher
) -> list[Restarter]:
    """Start the members and return their restarters; when `stack` closes, it stops the members."""
    fleet = Fleet(configuration, members, watcher)
    stack.callback(fleet.stop)
    fleet.start()
    return fleet.collecting or fleet.evaluating


def _count(progress: ProgramReport, role: Role, rows: Sequence[StepResult]) -> None:
    infos: list[dict[str, Any]] = [
        row.marked | ({} if row.episode is None else {"episode": row.episode}) for row in rows
    ]
    progress.played(role, infos)
