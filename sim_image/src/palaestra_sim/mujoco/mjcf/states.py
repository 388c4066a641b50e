"""Save and load states of bodies by name. A loaded body is at rest.

A state has the positions of joints, and the poses of bodies without joints, which a client may set.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

import numpy as np

from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.nodes.scene_node import SceneNode

_POSITION: Final = 3  # numbers of a position, before those of a quaternion
_INITIAL: Final = "__init__"  # the state of the world file


class _State(NamedTuple):
    """The positions of all joints, and the poses of all bodies and of all mocap bodies: (n, 7) each."""

    positions: Any
    bodies: Any
    mocaps: Any


class BodyStates:
    """The states that clients have saved.

    Args:
        model: the model in its initial state.
        bodies: maps a node to the number of its body.
    """

    def __init__(self, model: Model, bodies: Mapping[SceneNode, int]) -> None:
        self._model = model
        self._bodies = bodies
        self._start = self._now()
        self._saved: dict[tuple[int, str], _State] = {}

    def save(self, node: SceneNode, name: str) -> None:
        """Save the state of a node, and of all nodes inside it."""
        self._saved[node.number, name] = self._now()

    def load(self, node: SceneNode, name: str) -> None:
        """Return a node, and all nodes inside it, to a saved state.

        Raises:
            UnsimulatedError: no state of that name was saved.
        """
        state = self._start if name == _INITIAL else self._saved.get((node.number, name))
        if state is None:
            raise UnsimulatedError(f"{node.type_name} has no state {name!r}; save it first")
        now = self._model.data.qpos.copy()
        self._model.data.qpos[:] = state.positions
        wanted = {it: self._model.positions(it).copy() for it in self._joints(node)}
        self._model.data.qpos[:] = now
        for body in self._inside(node):
            self._stand(body, state)
        for joint, saved in wanted.items():
            self._model.positions(joint)[:] = saved
            self._model.speeds(joint)[:] = 0.0
        # Discard the solver's start values too, so that the motion does not depend on earlier motion.
        self._model.data.qacc_warmstart[:] = 0.0
        self._model.changed()

    def _now(self) -> _State:
        model, data = self._model.model, self._model.data
        return _State(
            positions=data.qpos.copy(),
            bodies=np.hstack((model.body_pos, model.body_quat)),
            mocaps=np.hstack((data.mocap_pos, data.mocap_quat)),
        )

    def _stand(self, body: int, state: _State) -> None:
        """Return a body without joints to its pose in a state."""
        model, data = self._model.model, self._model.data
        mocap = int(model.body_mocapid[body])
        if mocap >= 0:
            data.mocap_pos[mocap], data.mocap_quat[mocap] = np.split(state.mocaps[mocap], [_POSITION])
        elif not self._model.joints_of(body):
            model.body_pos[body], model.body_quat[body] = np.split(state.bodies[body], [_POSITION])

    def _inside(self, node: SceneNode) -> list[int]:
        return [self._bodies[it] for it in (node, *node.descendants()) if it in self._bodies]

    def _joints(self, node: SceneNode) -> list[int]:
        return [joint for number in self._inside(node) for joint in self._model.joints_of(number)]
