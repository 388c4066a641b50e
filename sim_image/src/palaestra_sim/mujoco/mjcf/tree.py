"""Make nodes from the bodies, joints and devices of a model, for a supervisor.

A body becomes a Solid, whose DEF is the name of the body. The body of the robot becomes a Robot; it has all
devices that are not on a joint. The DEF of a joint is the name of the joint. If a body has the same name,
`_joint` is appended to the DEF of the joint.
"""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.mujoco.mjcf.body_frame import BodyFrame
from palaestra_sim.mujoco.mjcf.model import Model
from palaestra_sim.mujoco.mjcf.robot import Equipment
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.tree.scene_tree import SceneTree
from palaestra_sim.world import Item, Node, Value, World
from palaestra_sim.world.mjcf import Description
from palaestra_sim.world.tokens import Tokens

# The node types of joints, by mjtJoint; a free joint has no node.
_JOINTS: Final = {
    1: "BallJoint",
    2: "SliderJoint",
    3: "HingeJoint",
}
_PARAMETERS: Final = {"HingeJoint": "HingeJointParameters", "SliderJoint": "JointParameters"}


@dataclass(slots=True, kw_only=True)
class ModelTree:
    """The nodes of a model.

    Attributes:
        scene: all nodes.
        robot: the node of the robot.
        bodies: maps a node to the number of its body.
        joints: maps a node to the number of its joint.
    """

    scene: SceneTree
    robot: SceneNode
    bodies: dict[SceneNode, int] = field(default_factory=dict)
    joints: dict[SceneNode, int] = field(default_factory=dict)


def grow(
    model: Model, description: Description, equipment: Equipment, body: int, basic_step_ms: int
) -> ModelTree:
    """Return the nodes of a model, with their frames.

    Args:
        model: the model, with its current state.
        description: the names that the file gives to robot and devices.
        equipment: the devices; `grow` adds their nodes to this object.
        body: the number of the robot's body.
        basic_step_ms: the basic step in milliseconds.
    """
    builder = _Builder(model, description, equipment, body)
    scene = SceneTree(builder.world(basic_step_ms), description.source.name)
    found = {
        builder.kinds[node.origin.node.span[0]]: node
        for node in scene.nodes.values()
        if node.origin is not None
    }
    tree = ModelTree(scene=scene, robot=found["body", body])
    tree.bodies = {node: int(number) for (kind, number), node in found.items() if kind == "body"}
    tree.joints = {node: int(number) for (kind, number), node in found.items() if kind == "joint"}
    equipment.devices.nodes.update(
        {str(name): node for (kind, name), node in found.items() if kind == "device"}
    )
    _place(model, tree)
    return tree


def _place(model: Model, tree: ModelTree) -> None:
    """Set the frames of all bodies; a parent comes before its children."""
    places: dict[int, BodyFrame] = {}
    for node, number in sorted(tree.bodies.items(), key=lambda pair: pair[1]):
        parent = places.get(int(model.model.body_parentid[number]))
        node.place = places[number] = BodyFrame(parent, model, number)


class _Builder:
    """Builds the nodes; each node gets a unique number as its span, by which the tree finds the node later.

    Attributes:
        kinds: for each span number, the kind of the model's object, and the object's number or name.
    """

    def __init__(self, model: Model, description: Description, equipment: Equipment, body: int) -> None:
        self._model = model
        self._description = description
        self._equipment = equipment
        self._robot = body
        self._numbers = itertools.count()
        self.kinds: dict[int, tuple[str, int | str]] = {}
        self._body_names = {model.model.body(it).name for it in range(model.model.nbody)}

    def world(self, basic_step_ms: int) -> World:
        """Return the nodes in the form of a world file."""
        model = self._model.model
        info = self._node(
            "WorldInfo",
            ("world", 0),
            basicTimeStep=_value(float(basic_step_ms)),
            gravity=_value(-float(model.opt.gravity[2])),
            title=_value(self._description.robot),
        )
        nodes = (info, *self._children(0))
        data = self._description.source.data
        return World(source=data, header="", nodes=nodes, externs=(), tokens=Tokens(data))

    def _children(self, body: int) -> tuple[Node, ...]:
        model = self._model.model
        numbers = (it for it in range(1, model.nbody) if model.body_parentid[it] == body)
        return tuple(node for number in numbers for node in self._body(number))

    def _body(self, number: int) -> tuple[Node, ...]:
        """Return the nodes of a body's joints; the node of the last joint has the body as its end point.

        For a body without joints, return the node of the body.
        """
        name = self._model.model.body(number).name
        children = list(self._children(number))
        fields: dict[str, Value] = {"name": _value(name or f"body{number}")}
        if number == self._robot:
            children += self._devices(None)
            fields |= self._of_robot()
        fields["children"] = _list(children)
        type_name = "Robot" if number == self._robot else "Solid"
        end = self._node(type_name, ("body", number), name, **fields)
        joints = [it for it in self._model.joints_of(number) if self._type(it) is not None]
        if not joints:
            return (end,)
        return (*(self._joint(it) for it in joints[:-1]), self._joint(joints[-1], end))

    def _of_robot(self) -> Mapping[str, Value]:
        return {
            "name": _value(self._description.robot),
            "controller": _value("ros"),
            "controllerArgs": _list(self._description.arguments),
            "supervisor": _value(True),
        }

    def _joint(self, number: int, end: Node | None = None) -> Node:
        model = self._model.model
        type_name = self._type(number) or ""
        name = model.jnt(number).name
        fields: dict[str, Value] = {}
        if type_name in _PARAMETERS:
            x, y, z = model.jnt_axis[number].tolist()
            parameters = self._node(_PARAMETERS[type_name], ("parameters", number), axis=_value(x, y, z))
            fields["jointParameters"] = _value(parameters)
        fields["device"] = _list(self._devices(number))
        if end is not None:
            fields["endPoint"] = _value(end)
        def_name = f"{name}_joint" if name in self._body_names else name
        return self._node(type_name, ("joint", number), def_name, **fields)

    def _devices(self, joint: int | None) -> list[Node]:
        rows = self._equipment.devices.rows
        return [
            self._node(kind.node, ("device", name), name=_value(name))
            for name, (kind, _) in rows.items()
            if self._equipment.joints.get(name) == joint
        ]

    def _type(self, joint: int) -> str | None:
        return _JOINTS.get(int(self._model.model.jnt_type[joint]))

    def _node(self, type_name: str, what: tuple[str, int | str], def_name: str = "", **fields: Value) -> Node:
        number = next(self._numbers)
        self.kinds[number] = what
        return Node(
            type_name=type_name,
            def_name=def_name or None,
            uses=None,
            fields=fields,
            span=(number, number),
        )


def _value(*items: Item) -> Value:
    return Value(items=items, bracketed=False, span=(0, 0))


def _list(items: Sequence[Any]) -> Value:
    return Value(items=tuple(items), bracketed=True, span=(0, 0))
