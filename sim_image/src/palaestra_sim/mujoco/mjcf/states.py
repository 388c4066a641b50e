"""Save and load states of bodies by name. A state has the positions of joints; a loaded body is at rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final

from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.nodes.scene_node import SceneNode

_INITIAL: Final = "__init__"  # the state of the world file


class BodyStates:
    """The states that clients have saved.

    Args:
        model: the model in its initial state.
        bodies: maps a node to the number of its body.
    """

    def __init__(self, model: Model, bodies: Mapping[SceneNode, int]) -> None:
        self._model = model
        self._bodies = bodies
        self._start = model.data.qpos.copy()
        self._saved: dict[tuple[int, str], Any] = {}

    def save(self, node: SceneNode, name: str) -> None:
        """Save the positions of the joints of a node, and of all nodes inside it."""
        self._saved[node.number, name] = self._model.data.qpos.copy()

    def load(self, node: SceneNode, name: str) -> None:
        """Return the joints of a node, and of all nodes inside it, to a saved state.

        Raises:
            UnsimulatedError: no state of that name was saved.
        """
        positions = self._start if name == _INITIAL else self._saved.get((node.number, name))
        if positions is None:
            raise UnsimulatedError(f"{node.type_name} has no state {name!r}; save it first")
        now = self._model.data.qpos.copy()
        self._model.data.qpos[:] = positions
        wanted = {it: self._model.positions(it).copy() for it in self._joints(node)}
        self._model.data.qpos[:] = now
        for joint, saved in wanted.items():
            self._model.positions(joint)[:] = saved
            self._model.speeds(joint)[:] = 0.0
        # Discard the solver's start values too, so that the motion does not depend on earlier motion.
        self._model.data.qacc_warmstart[:] = 0.0
        self._model.changed()

    def _joints(self, node: SceneNode) -> list[int]:
        inside = (self._bodies[it] for it in (node, *node.descendants()) if it in self._bodies)
        return [joint for number in inside for joint in self._model.joints_of(number)]
