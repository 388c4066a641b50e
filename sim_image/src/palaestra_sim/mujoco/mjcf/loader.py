"""Load an MJCF file as a simulation; the error for a mistake names the line of the file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Final

from palaestra_sim.errors import WorldError
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.mujoco.mjcf.robot import Equipment, body_of, equip
from palaestra_sim.mujoco.mjcf.simulation import MjcfSimulation
from palaestra_sim.mujoco.mjcf.tree import ModelTree, grow
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.arguments import read_arguments
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.robot_parts import RobotParts
from palaestra_sim.scene.validation import LeaveOut, NodeReader
from palaestra_sim.scene.visuals import View
from palaestra_sim.world import mjcf
from palaestra_sim.world.bounded_read import read_bounded
from palaestra_sim.world.mjcf import Description

_LINE: Final = re.compile(r"\bline (\d+)")


def load(
    world_path: Path, mode: Mode, leave_out: LeaveOut | None = None, *, root: Path | None = None
) -> MjcfSimulation:
    """Return the simulation of an MJCF world.

    Args:
        world_path: the MJCF file.
        mode: the simulation mode at the start.
        leave_out: the types of sensors and actuators to leave out.
        root: the folder that holds all files that the model names; None means the nearest such folder.

    Raises:
        WorldError: the file is wrong, or the model has no body or no actuator.
        OSError: the file cannot be read.
    """
    source = read_bounded(world_path)
    leave_out = leave_out or LeaveOut()
    mjcf.check(source, world_path.name, relative_addresses=True)
    description = mjcf.describe(source, world_path.name)
    project = mjcf.Project(world_path, description, root)
    project.open()
    description = mjcf.with_parts(description, project.roots)
    compiled = _compiled(world_path)
    model = Model(compiled, _keyframe(compiled, description))
    basic_step_ms = _basic_step_ms(compiled, description)
    body = body_of(compiled)
    if compiled.nu == 0 or body is None:
        fact = f"the model has no {'body' if body is None else 'actuator'}, so a trainer cannot move anything"
        raise description.error("", "", fact, "add a body with a joint, and an actuator for it")
    equipment = equip(model, description, leave_out)
    tree = grow(model, description, equipment, body, basic_step_ms)
    robot = _robot(tree, equipment, description, leave_out)
    return MjcfSimulation(model, tree, equipment, robot, basic_step_ms=basic_step_ms, mode=mode)


def _robot(tree: ModelTree, equipment: Equipment, description: Description, leave_out: LeaveOut) -> Robot:
    reading = NodeReader(equipment.refused, leave_out, "MuJoCo", mesh_files=tree.scene.mesh_files)
    arguments = read_arguments(reading, tree.robot)
    reading.conclude()
    parts = RobotParts(
        node=tree.robot,
        name=description.robot,
        place=tree.robot.place or Frame(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)),
        devices=equipment.devices,
        body=None,
        arguments=arguments,
    )
    return Robot(
        parts, 0, MujocoPhysics(), View(tree.scene.root)
    )  # this physics is never used, because the sensors read the model


def _compiled(world_path: Path) -> Any:
    """Return MuJoCo's model of a file.

    Raises:
        WorldError: MuJoCo refuses the file.
    """
    try:
        return mujoco.MjModel.from_xml_path(str(world_path))
    except (MemoryError, RuntimeError, ValueError) as error:
        text = " ".join(str(error).split())
        line = _LINE.search(text)
        remedy = "correct the model; MuJoCo's XML reference has every element"
        raise WorldError(world_path.name, int(line[1]) if line else 1, 1, text, remedy) from None


def _keyframe(model: Any, description: Description) -> int | None:
    name = description.keyframe
    if not name:
        return None
    number = int(mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_KEY, name))
    if number < 0:
        known = ", ".join(model.key(it).name for it in range(model.nkey)) or "none"
        fact = f"the model has no keyframe {name!r}"
        raise description.error("custom", "keyframe", fact, f"write one of: {known}")
    return number


def _basic_step_ms(model: Any, description: Description) -> int:
    """Return the basic step in milliseconds: the file's own, or a multiple of MuJoCo's timestep.

    The timestep is read from the compiled model, because an included file may set it.
    """
    timestep_s = float(model.opt.timestep)
    step_ms = description.basic_step_ms or mjcf.whole_step_ms(timestep_s)
    if step_ms is None:
        shorter, longer = mjcf.fitting_timesteps_s(timestep_s)
        fact = f"no short basic step of whole milliseconds fits the timestep of {timestep_s:g} s"
        raise description.error("", "", fact, f"write a timestep of {shorter:g} or {longer:g}")
    if not mjcf.fits(step_ms, timestep_s):
        fact = f"basicTimeStep {step_ms:g} is not a multiple of the timestep of {timestep_s:g} s in whole ms"
        remedy = f"write {mjcf.whole_step_ms(timestep_s) or 'another'}"
        raise description.error("custom", "basicTimeStep", fact, remedy)
    return int(step_ms)
