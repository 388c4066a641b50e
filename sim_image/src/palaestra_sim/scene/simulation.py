"""The simulated world, without ROS: load it, command motors, step it, read sensors.

    simulation = Simulation.load(world_bytes, StubPhysics())
    robot = simulation.robots[0]
    robot.motors["wheel0_joint"].set_position(math.inf)
    robot.motors["wheel0_joint"].set_velocity(2.0)
    simulation.step(192)
    robot.sensors["ir1"].value

The same world, commands and seed give the same values, bit for bit. Only steps advance the time.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping

from palaestra_sim.errors import SimError, WorldError
from palaestra_sim.scene.appearance import Appearance
from palaestra_sim.scene.devices.connector import Connector
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.movies import Movies
from palaestra_sim.scene.node_motion import NodeMotion
from palaestra_sim.scene.nodes.instantiate import Descriptions
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.scene.observers import OutlineObservers
from palaestra_sim.scene.physics import Abilities, Physics
from palaestra_sim.scene.radio import Radio
from palaestra_sim.scene.reader import SceneContents, read_added, read_scene
from palaestra_sim.scene.robot import Robot
from palaestra_sim.scene.saved_states import States, require_joint
from palaestra_sim.scene.shapes import bounding_shapes
from palaestra_sim.scene.textures import Textures
from palaestra_sim.scene.tree.fields import NodeField
from palaestra_sim.scene.tree.scene_tree import SceneTree
from palaestra_sim.scene.tree.write_rules import require_removable, require_room
from palaestra_sim.scene.validation import LeaveOut, NodeReader
from palaestra_sim.scene.viewpoint import save_view, view
from palaestra_sim.scene.visuals import View
from palaestra_sim.world import World, parse


class Simulation:
    """One loaded world. A reload creates another Simulation.

    Attributes:
        tree: the nodes of the world.
        robots: the robots, in the order of the world file.
        time_ms: simulated time; a reset sets it to 0.
        mode: the mode, for the program that paces the steps; `step` works in every mode.
        quit_status: the exit status that `quit` requested; None before that request.
        motion: the motion of robots and dynamic solids, for a supervisor.
        movies: recordings of the Viewpoint's view.
        appearance: the visible shapes and poses, for viewers.
    """

    def __init__(self, tree: SceneTree, scene: SceneContents, mode: Mode) -> None:
        self.tree = tree
        self.scene = scene
        self._view = View(tree.root, Textures(tree.read), tree.mesh_files)
        self.appearance = Appearance(self._view, lambda: self.robots)
        self.movies = Movies(
            lambda size: view(tree.root, scene.physics, size), scene.physics.film, scene.basic_step_ms
        )
        scene.physics.show(self._view)
        self.robots = tuple(
            Robot(parts, scene.random_seed, scene.physics, self._view) for parts in scene.robots
        )
        self.time_ms = 0
        self.mode = mode
        self.quit_status: int | None = None
        self._pending: list[Callable[[], None]] = []
        self._reset_asked = self._solids_moved = False
        self._added: list[SceneNode] = []
        self.motion = NodeMotion(scene, self.robot_of, tree.mesh_files)
        self._states = States(tree.nodes.values())
        self._assemble()
        self._step_s = scene.basic_step_ms / 1000.0
        scene.physics.begin(scene.surroundings)
        self._arrange()

    @classmethod
    def load(
        cls, source: bytes, physics: Physics, name: str = "world", mode: Mode = Mode.REAL_TIME
    ) -> Simulation:
        """Return the simulation of a world file that needs no other file.

        Raises:
            WorldError: the file is wrong, or contains an object that cannot be simulated.
        """
        return cls.of(parse(source, name), physics, name, mode)

    @classmethod
    def of(
        cls,
        world: World,
        physics: Physics,
        name: str = "world",
        mode: Mode = Mode.REAL_TIME,
        descriptions: Descriptions | None = None,
        leave_out: LeaveOut | None = None,
    ) -> Simulation:
        """Return the simulation of a world.

        Args:
            world: the parsed world.
            physics: the physics that moves the robots.
            name: the name of the world file, in errors.
            mode: the simulation mode at the start.
            descriptions: the descriptions of the types that are not base types, and the files that nodes
                name.
            leave_out: the nodes that may be left out, if they cannot be simulated.

        Raises:
            WorldError: the world contains an object that cannot be simulated.
        """
        tree = SceneTree(world, name, descriptions)
        return cls(tree, read_scene(tree, physics, leave_out), mode)

    @property
    def unread_textures(self) -> int:
        """The number of visible shapes with a texture that infra-red sensors do not see."""
        return self._view.unread_textures()

    @property
    def unread_meshes(self) -> Mapping[str, int]:
        """The number of visible shapes by type that no sensor sees; see `View.unread_meshes`."""
        return self._view.unread_meshes()

    @property
    def left_out(self) -> tuple[WorldError, ...]:
        """The unsupported nodes that the user left out, and unknown PROTO fields, each with its position."""
        return (*self.scene.left_out, *self.tree.ignored)

    @property
    def abilities(self) -> Abilities:
        """The contents of a world that the physics simulates."""
        return self.scene.physics.abilities

    @property
    def basic_step_ms(self) -> int:
        """WorldInfo.basicTimeStep."""
        return self.scene.basic_step_ms

    def step(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`, then set the values of the sensors.

        Raises:
            ValueError: the duration is not a positive multiple of the basic step.
        """
        self.advance(duration_ms)
        self.sample()

    def advance(self, duration_ms: int) -> None:
        """Simulate for `duration_ms`; the sensors keep their values.

        Raises:
            ValueError: the duration is not a positive multiple of the basic step.
        """
        count, rest = divmod(duration_ms, self.scene.basic_step_ms)
        if rest or count < 1:
            raise ValueError(
                f"step: {duration_ms} ms is not a positive multiple of the basic step;"
                f" use a multiple of {self.scene.basic_step_ms} ms"
            )
        for _ in range(count):
            self._basic_step()

    def sample(self) -> None:
        """Set every sensor to its value at the current time."""
        for sample in self._samplers:
            sample()

    def before_next_step(self, change: Callable[[], None]) -> None:
        """Register a change, such as the write of a field, for the beginning of the next basic step."""
        self._pending.append(change)

    def reset(self) -> None:
        """Request a reset of the world within the next basic step.

        The reset restores the time, the poses of all solids and robots, the motors, and the noise with the
        current seed in customData. The reset does not restore other fields that a client has written.
        """
        self._reset_asked = True

    def reset_physics(self) -> None:
        """Stop all motion immediately."""
        for robot in self.robots:
            robot.halt()
        for thing in self.scene.loose:
            thing.place.halt()
        for door in self.scene.doors:
            if door.joint is not None:
                door.joint.halt()

    def quit(self, status: int) -> None:
        """Request the end of the simulator."""
        self.quit_status = status

    def robot_of(self, node: SceneNode) -> Robot | None:
        """Return the robot of a Robot node; None for any other node."""
        return next((robot for robot in self.robots if robot.parts.node is node), None)

    def changed(self, node: SceneNode, field: str) -> None:
        """Apply the effect of a field that has a new value."""
        if node.outline:
            self._resize(node)
        self._view.written(node, field)
        if node.place is None or field not in {"translation", "rotation"}:
            return
        if field == "translation":
            x, y, z = node.numbers(field) or (0.0, 0.0, 0.0)
            node.place.translation = (x, y, z)
        else:
            x, y, z, angle_rad = node.numbers(field) or (0.0, 0.0, 1.0, 0.0)
            node.place.rotation = (x, y, z, angle_rad)
        self._moved(node.place)

    def add(self, text: str, field: NodeField, index: int) -> bool:
        """Insert the nodes of `text` into a field immediately; return False if the index is not valid.

        A reset removes the nodes again. A negative `index` counts from the end: -1 is after the last node.

        Raises:
            WorldError: the text is wrong, or contains an object that cannot be simulated.
            UnsimulatedError: the field does not accept such nodes while the simulation runs.
        """
        at = field.room(index)
        if at is None:
            return False
        added = self.tree.grow(text, field.node)
        try:
            require_room(field.node, field.name, added)
            fresh = SceneContents(physics=self.scene.physics)  # stays empty if the field is not children
            if field.name == "children":
                fresh = read_added(self.tree, added, self.scene)
        except SimError:
            self.tree.forget(added)
            raise
        self.tree.attach(added, field.name, at)
        self._view.changes += 1
        self._added += added
        self._states.begin(inside for node in added for inside in (node, *node.descendants()))
        self.scene.solids += fresh.solids
        self.scene.loose += fresh.loose
        self.scene.doors += fresh.doors
        self.scene.robots += fresh.robots
        self.robots += tuple(
            Robot(parts, self.scene.random_seed, self.scene.physics, self._view) for parts in fresh.robots
        )
        self._assemble()
        self._arrange()
        return True

    def remove(self, node: SceneNode) -> None:
        """Remove a node and all nodes inside it immediately; a reset does not restore them.

        Raises:
            UnsimulatedError: the simulation cannot continue without the node.
        """
        require_removable(node)
        gone = {node, *node.descendants()}
        self.tree.remove(node)
        self._view.changes += 1
        self.scene.solids = [shape for shape in self.scene.solids if shape.node not in gone]
        self.scene.loose = [thing for thing in self.scene.loose if thing.node not in gone]
        self.scene.doors = [link for link in self.scene.doors if link.node not in gone]
        self.scene.robots = [parts for parts in self.scene.robots if parts.node not in gone]
        self.robots = tuple(robot for robot in self.robots if robot.parts.node not in gone)
        self._assemble()
        self._arrange()

    def export_image(self, path: str, quality: int) -> bool:
        """Save the Viewpoint's view as a PNG or JPEG file; return whether that was possible.

        Raises:
            UnsimulatedError: the path does not have the suffix of a PNG or JPEG file, or this machine cannot
                render.
        """
        return save_view(self.tree.root, self.scene.physics, path, quality)

    def contact_points(self, node: SceneNode, *, descendants: bool) -> list[tuple[Vector, int]]:
        """Return a node's contact points: positions in meters, each with the number of a touching node."""
        asked = {node, *node.descendants()} if descendants else {node}
        return [
            (point if self.scene.top is None else self.scene.top.from_ground(point), touching.number)
            for point, nodes in self.scene.physics.contacts()
            for touching in nodes
            if touching in asked
        ]

    def save_state(self, node: SceneNode, name: str) -> None:
        """Save the frames and joints of a node, and of all nodes inside it, under a name."""
        self._states.save(node, name)

    def load_state(self, node: SceneNode, name: str) -> None:
        """Return a node to a saved state and stop its motion; "__init__" is the state in the world file.

        Raises:
            UnsimulatedError: no state of that name was saved.
        """
        self._states.load(node, name)
        self._view.moves += 1
        around = {node, *node.descendants(), *node.ancestors()}
        halts = [robot.halt for robot in self.robots if robot.parts.node in around]
        halts += [thing.place.halt for thing in self.scene.loose if thing.node in around]
        for halt in halts:
            halt()
        self._solids_moved = True
        self._arrange()

    def set_joint_position(self, node: SceneNode, position: float, index: int) -> None:
        """Set the position of a joint, in rad or m; the joint's motor holds this position.

        Raises:
            UnsimulatedError: the node is not a joint with an axis `index`, counted from 1.
        """
        if math.isfinite(position):
            require_joint(node, index).joint.put(position)

    def _assemble(self) -> None:
        """Connect the devices of all robots."""
        devices = [[it for _, it in robot.parts.devices.rows.values()] for robot in self.robots]
        self._air = Radio(devices)
        connectors = tuple(it for robot in devices for it in robot if isinstance(it, Connector))
        for connector in connectors:
            connector.others = connectors
        self._observers = OutlineObservers((it for robot in devices for it in robot), self.tree.mesh_files)
        self._show_outlines()
        self._samplers = tuple(sample for robot in self.robots for sample in robot.samplers)

    def _show_outlines(self) -> None:
        self._observers.show(self.tree.nodes.values(), self.scene.surroundings.floors_m)

    def _resize(self, node: SceneNode) -> None:
        """Read the outline of an obstacle again, because a part of it has a new size."""
        owner = next((around for around in node.ancestors() if around.place is not None), None)
        if owner is not None and owner.place is not None:
            fresh = bounding_shapes(NodeReader(mesh_files=self.tree.mesh_files), owner, owner.place)
            solids = self.scene.solids
            first = next((at for at, shape in enumerate(solids) if shape.place is owner.place), len(solids))
            kept = [shape for shape in solids if shape.place is not owner.place]
            self.scene.solids = [*kept[:first], *fresh, *kept[first:]]
            self._show_outlines()
            self._arrange()

    def _moved(self, place: Frame) -> None:
        """Arrange the world again if `place` carries a part of it, or if a robot's height has changed."""
        places = [shape.place for shape in self.scene.solids] + [door.place for door in self.scene.doors]
        places += [floor.place for floor in self.scene.surroundings.floors]
        lifted = self._heights != self._heights_now()
        if lifted or any(place in moving.chain() for moving in places):
            self._solids_moved = True
            self._arrange()

    def _heights_now(self) -> list[float]:
        """Return the heights in meters of all robots with a body; only a client lifts such a robot."""
        return [robot.place.height_m for robot in self.robots if robot.body is not None]

    def _arrange(self) -> None:
        self._heights = self._heights_now()
        self.scene.physics.arrange(self.robots, self.scene.solids, self.scene.loose, self.scene.doors)

    def _basic_step(self) -> None:
        if self._pending:
            pending, self._pending = self._pending, []
            for change in pending:
                change()
        step_s = self._step_s
        for robot in self.robots:
            robot.begin(step_s)
        self.scene.physics.advance(step_s)
        for robot in self.robots:
            robot.turn(step_s)
        self._air.deliver()
        if self._reset_asked:
            self._restore()
        self.time_ms += self.scene.basic_step_ms
        self.movies.stepped()

    def _restore(self) -> None:
        self._reset_asked = False
        self.time_ms = 0
        self.scene.physics.reset()
        added, self._added = self._added, []
        for node in added:
            if self.tree.of_number(node.number) is node:
                self.remove(node)
        for node in self.tree.nodes.values():
            if node.place is not None:
                node.place.return_to_start()
        self._view.moves += 1
        self._air.clear()
        for robot in self.robots:
            robot.reset()
        if self._solids_moved:
            self._solids_moved = False
            self._arrange()
