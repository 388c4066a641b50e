"""States of nodes, saved and loaded by name: frames, and the positions of joints.

A state covers a node and all nodes inside it. Loaded nodes are at rest. Motors of wheels keep their angles
and stop.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from palaestra_sim.ros_interfaces import UnsimulatedError
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import AxisAngle, Vector
from palaestra_sim.scene.joints import JointFrame
from palaestra_sim.scene.nodes.scene_node import SceneNode

INITIAL: Final = "__init__"  # the state of the world file
JOINTS: Final = frozenset(("HingeJoint", "SliderJoint"))


class NodeState:
    """The frames and joint positions of a node and of all nodes inside it, at one moment."""

    def __init__(self, node: SceneNode) -> None:
        places = [it.place for it in (node, *node.descendants()) if it.place is not None]
        self._joints = [(it.joint, it.joint.now) for it in places if isinstance(it, JointFrame)]
        self._places: list[tuple[Frame, Vector, AxisAngle]] = [
            (it, it.translation, it.rotation) for it in places if not isinstance(it, JointFrame)
        ]

    def load(self) -> None:
        """Restore the saved frames and joint positions."""
        for place, translation, rotation in self._places:
            place.translation, place.rotation = translation, rotation
        for joint, position in self._joints:
            joint.put(position)


class States:
    """The states that clients have saved."""

    def __init__(self, nodes: Iterable[SceneNode]) -> None:
        self._saved: dict[tuple[int, str], NodeState] = {}
        self.begin(nodes)

    def begin(self, nodes: Iterable[SceneNode]) -> None:
        """Save the state of nodes that are new in the world."""
        for node in nodes:
            if node.place is not None:
                self._saved[node.number, INITIAL] = NodeState(node)

    def save(self, node: SceneNode, name: str) -> None:
        """Save the state of a node."""
        self._saved[node.number, name] = NodeState(node)

    def load(self, node: SceneNode, name: str) -> None:
        """Load a state of a node.

        Raises:
            UnsimulatedError: no state of that name was saved.
        """
        state = self._saved.get((node.number, name))
        if state is None:
            names = sorted(known for number, known in self._saved if number == node.number)
            known = ", ".join(names) or "none"
            raise UnsimulatedError(f"{node.type_name} has no state {name!r}; save it first (saved: {known})")
        state.load()


def require_joint(node: SceneNode, index: int) -> JointFrame:
    """Return the end of the joint at `node`; `index` is the number of the joint's axis, counted from 1.

    Raises:
        UnsimulatedError: the node is not a joint with that axis.
    """
    if node.type_name not in JOINTS:
        fact = f"a {node.type_name} has no joint position"
        raise UnsimulatedError(f"{fact}; use one of {', '.join(sorted(JOINTS))}")
    if index != 1:
        raise UnsimulatedError(f"a {node.type_name} has no axis {index}; use 1")
    for end in node.nodes("endPoint"):
        if isinstance(end.place, JointFrame):
            return end.place
    raise UnsimulatedError(f"this {node.type_name} has no node at its end; give it an endPoint")
