"""From an MJCF file to a simulation; every mistake in it is an error with its place."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator
from itertools import chain
from pathlib import Path
from typing import Any, Final

from palaestra_sim.errors import WorldError, refusal
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.mujoco.mjcf.robot import Equipment, body_of, equip
from palaestra_sim.mujoco.mjcf.simulation import MjcfSimulation
from palaestra_sim.mujoco.mjcf.tree import ModelTree, grow
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.arguments import read_arguments
from palaestra_sim.scene.drawn import View
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.places import Place
from palaestra_sim.scene.reading import LeaveOut, Reading
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.robot_reader import RobotParts
from palaestra_sim.world import mjcf
from palaestra_sim.world.bounded import read_bounded
from palaestra_sim.world.mjcf import Description
from palaestra_sim.world.mjcf.elements import Element
from palaestra_sim.world.source import Source

_LINE: Final = re.compile(r"\bline (\d+)")
_INSIDE: Final = "put it beside the world, or beside the folder of the world"


def load(world_path: Path, mode: Mode, leave_out: LeaveOut | None = None) -> MjcfSimulation:
    """Return the simulation of an MJCF world, which runs in that mode at first.

    Raises:
        WorldError: the file is wrong, or has something that no client could use.
        OSError: it cannot be read.
    """
    source = read_bounded(world_path)
    leave_out = leave_out or LeaveOut()
    mjcf.check(source, world_path.name, relative_addresses=True)
    description = mjcf.describe(source, world_path.name)
    collected = _Parts(world_path.absolute().parent, description)
    if error := refusal(chain(collected.read(), collected.beside_the_root())):
        raise error
    description = mjcf.with_parts(description, collected.roots)
    compiled = _compiled(world_path)
    model = Model(compiled, _keyframe(compiled, description))
    basic_step_ms = _basic_step_ms(compiled, description)
    body = body_of(compiled)
    if compiled.nu == 0 or body is None:
        fact = f"the model has no {'body' if body is None else 'actuator'}, so a trainer can move nothing"
        raise description.error("", "", fact, "add a body with a joint, and an actuator for it")
    equipment = equip(model, description, leave_out)
    tree = grow(model, description, equipment, body, basic_step_ms)
    robot = _robot(tree, equipment, description, leave_out)
    return MjcfSimulation(model, tree, equipment, robot, basic_step_ms=basic_step_ms, mode=mode)


def _robot(tree: ModelTree, equipment: Equipment, description: Description, leave_out: LeaveOut) -> Robot:
    reading = Reading(equipment.refused, leave_out, "MuJoCo")
    arguments = read_arguments(reading, tree.robot)
    reading.conclude()
    parts = RobotParts(
        node=tree.robot,
        name=description.robot,
        place=tree.robot.place or Place(None, (0.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0)),
        devices=equipment.devices,
        body=None,
        arguments=arguments,
    )
    return Robot(
        parts, 0, MujocoPhysics(), View(tree.scene.root)
    )  # nothing asks this physics: sensors read the model


def _compiled(world_path: Path) -> Any:
    """Return MuJoCo's model of a file.

    Raises:
        WorldError: MuJoCo refuses it.
    """
    try:
        return mujoco.MjModel.from_xml_path(str(world_path))
    except ValueError as error:
        text = " ".join(str(error).split())
        line = _LINE.search(text)
        remedy = "correct the model; MuJoCo's XML reference has every element"
        raise WorldError(world_path.name, int(line[1]) if line else 1, 1, text, remedy) from None


class _Parts:
    """The other files of which MuJoCo reads elements, and what they include.

    MuJoCo looks for such a file beside the world, then in the folders that the world names, then beside the
    file that includes it.

    Attributes:
        roots: the elements of the files that were read.
    """

    def __init__(self, folder: Path, description: Description) -> None:
        self.roots: list[Element] = []
        self._folder = folder
        self._description = description
        self._named = ["", *(path for _, path in mjcf.named_folders(description.root))]

    def read(self) -> Iterator[WorldError]:
        """Read all files; yield what is wrong with them, and with what they include."""
        description = self._description
        waiting = [("", description.source, description.root)]
        seen: set[Path] = set()
        while waiting:
            beside, source, root = waiting.pop()
            for part in mjcf.parts(root):
                found = self._found(part, beside)
                if found is None:
                    fact = f"the file {part!r}, of which the model consists too, is missing"
                    yield source.error(root.start, fact, "put it beside the world, or beside this file")
                elif not mjcf.in_project(found):
                    yield source.error(
                        root.start, f"{part!r} is outside of the project of the world", _INSIDE
                    )
                elif (file := self._folder / found) not in seen:
                    seen.add(file)
                    inner = Source(data=read_bounded(file), name=part)
                    elements = mjcf.read(inner)
                    self.roots.append(elements)
                    yield from mjcf.strays(inner, elements, self._named, includes=False)
                    yield from mjcf.growing(inner, elements)
                    waiting.append((posixpath.dirname(found), inner, elements))

    def beside_the_root(self) -> Iterator[WorldError]:
        """Yield what leaves the folder of a world whose project would be the whole file system."""
        if self._folder.parent.parent != self._folder.parent:
            return
        description = self._description
        for element, path in (*mjcf.named_files(description.root), *mjcf.named_folders(description.root)):
            if not mjcf.in_project(posixpath.join("..", path)):
                fact = f"{path!r} is outside of the folder of the world"
                yield description.source.error(element.start, fact, "put the world one folder deeper")

    def _found(self, part: str, beside: str) -> str | None:
        """Return the path of the first file that there is, from the world's folder."""
        paths = (posixpath.normpath(posixpath.join(at, part)) for at in (*self._named, beside))
        return next((path for path in paths if (self._folder / path).is_file()), None)


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
    """Return the basic step; the timestep may come from another file of the model."""
    timestep_s = float(model.opt.timestep)
    step_ms = description.basic_step_ms or mjcf.whole_step_ms(timestep_s)
    if step_ms is None:
        shorter, longer = mjcf.fitting_timesteps_s(timestep_s)
        fact = f"no short basic step of whole milliseconds fits the timestep of {timestep_s:g} s"
        raise description.error("", "", fact, f"write a timestep of {shorter:g} or {longer:g}")
    if not mjcf.fits(step_ms, timestep_s):
        fact = f"basicTimeStep {step_ms:g} is no multiple of the timestep of {timestep_s:g} s in whole ms"
        remedy = f"write {mjcf.whole_step_ms(timestep_s) or 'another'}"
        raise description.error("custom", "basicTimeStep", fact, remedy)
    return int(step_ms)
