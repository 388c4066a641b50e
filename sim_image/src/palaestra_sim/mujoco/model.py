"""Build MuJoCo's model from the robots, shapes and links of a world.

The base of a robot is a body with three joints; an obstacle is a body without joints. As in the stub, a robot
may touch an obstacle only if both are at the same height. The robot does not touch an obstacle that it drives
over or under.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from palaestra_sim.mujoco.base_model import add_base, add_contact_sensors, begin_spec
from palaestra_sim.mujoco.body import MujocoBody, servo
from palaestra_sim.mujoco.free_bodies import FreeBody
from palaestra_sim.mujoco.friction import set_frictions
from palaestra_sim.mujoco.geoms import (
    LOOSE,
    ROBOTS,
    SEEN,
    STANDING,
    UNSEEN,
    Marks,
    Touch,
    add_geom,
    fill,
    own_bit,
    put,
)
from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.mujoco.links import Added, Ground, LinkBody, add_links, bodies
from palaestra_sim.scene.dynamic_solids import DynamicFrame, DynamicSolid
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.geometry import Pose
from palaestra_sim.scene.links import Link
from palaestra_sim.scene.physics import Figure, Push
from palaestra_sim.scene.physics_settings import PhysicsSettings, material_of
from palaestra_sim.scene.shapes import Shape


@dataclass(slots=True, eq=False)
class Built:
    """A compiled model with its data, and the objects of the scene to which its parts belong.

    Attributes:
        model, data: the model and the data of MuJoCo.
        figures: the robots that move, each with its body, and the number of this body in the model.
        geoms: for each geom, by its number: the shape, the body of the robot to which the shape belongs (None
            if it belongs to no robot), and the bit of the shape in `touched`.
        stands: for each frame that has obstacles or carries links, the number of the frame's body.
        loose: the dynamic solids, by their frames.
        links: the links of each robot; the key None has the links without a robot.
        own_geoms: the numbers of the geoms of the links in `links`, by the same keys.
        fixed: the poses of the obstacles that cannot move in this model, by their frames.
        of_robots: for each geom, by its number: whether the geom is a part of a robot.
        changed: the dynamic solids that a client has moved since the last `take`.
        floors_m: the heights of the Planes of the world.
    """

    model: Any
    data: Any
    figures: dict[Figure, tuple[MujocoBody, int]]
    geoms: dict[int, tuple[Shape, MujocoBody | None, int]]
    stands: dict[Frame, int]
    loose: dict[DynamicFrame, FreeBody]
    links: dict[Figure | None, tuple[LinkBody, ...]]
    own_geoms: dict[Figure | None, list[int]]
    fixed: dict[Frame, Pose]
    of_robots: Any
    changed: dict[DynamicFrame, None]
    floors_m: tuple[float, ...]

    def body_of(self, figure: Figure) -> int:
        """Return the number of a robot's body; -1 if the robot has no body."""
        found = self.figures.get(figure)
        return -1 if found is None else found[1]

    @contextmanager
    def unseen(self, figure: Figure) -> Iterator[None]:
        """Let rays pass through the links of a robot during the block."""
        own = self.own_geoms.get(figure)
        if own is None:
            yield
            return
        self.model.geom_group[own] = UNSEEN
        try:
            yield
        finally:
            self.model.geom_group[own] = SEEN

    def put_obstacles(self) -> None:
        """Set the poses of the obstacles to the poses of their frames."""
        for place, number in self.stands.items():
            mocap = self.model.body_mocapid[number]
            if mocap < 0:
                continue
            put(self.data.mocap_pos[mocap], self.data.mocap_quat[mocap], place.ground_pose)
        for figure, (_, number) in self.figures.items():
            self.model.body_pos[number][2] = figure.place.height_m

    def displaced(self) -> frozenset[Frame]:
        """Return the frames of obstacles that have moved since the model was built."""
        return frozenset(place for place, pose in self.fixed.items() if place.ground_pose != pose)

    def feel(self) -> None:
        """Record which parts of robots are touched."""
        touched = self.data.contact.geom.ravel()
        for geom in touched[self.of_robots[touched]].tolist():
            _, body, bit = self.geoms[geom]
            if body is not None:
                body.touched |= bit

    def take(self) -> bool:
        """Apply clients' changes of dynamic solids and joints; return whether there were changes."""
        changed = list(self.changed)
        self.changed.clear()
        for place in changed:
            self.loose[place].take()
        moved = [link for link in self.all_links() if link.take()]
        return bool(changed or moved)

    def all_links(self) -> Iterator[LinkBody]:
        """Yield the links of all robots, and the links without a robot."""
        for links in self.links.values():
            yield from links

    def push(self, target: Figure | DynamicSolid, push: Push) -> None:
        """Apply a force to a robot or a dynamic solid until the forces are cleared."""
        found = self.figures.get(target) if not isinstance(target, DynamicSolid) else None
        number = self.loose[target.place].number if isinstance(target, DynamicSolid) else -1
        number = number if found is None else found[1]
        torque = np.array(push.torque)
        if push.point is not None:
            torque += np.cross(np.array(push.point) - self.data.xipos[number], push.force)
        self.data.xfrc_applied[number] += np.concatenate((push.force, torque))

    def collide(self) -> None:
        """Compute all current contacts, also those of bodies that sleep, which a step leaves out."""
        options = self.model.opt
        usual = options.enableflags
        options.enableflags = usual & ~int(mujoco.mjtEnableBit.mjENBL_SLEEP)
        try:
            mujoco.mj_collision(self.model, self.data)
        finally:
            options.enableflags = usual

    def settle(self) -> None:
        """Compute the poses of all bodies from the positions of joints and obstacles."""
        mujoco.mj_kinematics(self.model, self.data)


@dataclass(frozen=True, slots=True, kw_only=True)
class Contents:
    """The contents of a model; see `Physics.arrange`."""

    figures: tuple[Figure, ...] = ()
    solids: tuple[Shape, ...] = ()
    loose: tuple[DynamicSolid, ...] = ()
    doors: tuple[Link, ...] = ()

    @property
    def moving(self) -> list[tuple[Figure, MujocoBody]]:
        """The robots that have bodies."""
        return [(it, it.body) for it in self.figures if isinstance(it.body, MujocoBody)]


def build(
    contents: Contents,
    surroundings: PhysicsSettings,
    moved: frozenset[Frame] = frozenset(),
    *,
    feeling: bool = False,
) -> Built:
    """Return the model of robots, obstacles, dynamic solids and links, in their current state.

    With `feeling`, the model has one contact sensor for each part of a robot, in the order of `Built.geoms`.

    To save time, MuJoCo does not simulate bodies at rest: they sleep. But a body that touches a movable
    obstacle never sleeps. So if the world has bodies that can sleep, obstacles are fixed in the model, except
    those that a client has moved (`moved`).
    """
    # The solids still have the states that the previous model computed.
    states = [thing.place.course for thing in contents.loose]
    spec, marks, moving = mujoco.MjSpec(), Marks(), contents.moving
    stands, fixed = _add_obstacles(spec, contents, moved, marks)
    robots = {figure: _add_robot(spec, figure, body, at, marks) for at, (figure, body) in enumerate(moving)}
    things = {thing: _add_loose(spec, thing, marks) for thing in contents.loose}
    roots = {figure.place: body for figure, body in robots.items()}
    roots.update((thing.place, body) for thing, body in things.items())
    links = _add_all_links(Ground(spec, roots, stands), contents, marks)
    floors = begin_spec(spec, surroundings)
    surfaces = [(geom, material_of(shape.node)) for geom, shape, _, _ in marks.entries]
    set_frictions(spec, [*((it, surroundings.floor) for it in floors), *surfaces], surroundings)
    if feeling:
        add_contact_sensors(spec, marks)
    model = spec.compile()
    data = mujoco.MjData(model)
    built = Built(
        model=model,
        data=data,
        figures={figure: (body, robots[figure].id) for figure, body in moving},
        geoms={geom.id: (shape, body, bit) for geom, shape, body, bit in marks.entries},
        stands={place: added.id for place, added in stands.items()},
        loose={it.place: FreeBody(it.place, model, data, added.id) for it, added in things.items()},
        fixed=fixed,
        of_robots=_of_robots(model.ngeom, marks),
        changed={},
        floors_m=tuple(floor.height_m for floor in surroundings.floors),
        links=bodies(links, model, data),
        own_geoms={
            whose: [geom.id for it in some for geom in it.body.geoms] for whose, some in links.items()
        },
    )
    _begin(built)
    for thing, state in zip(built.loose.values(), states, strict=True):
        thing.begin(state, built.changed)
    built.take()
    built.settle()
    return built


def _add_all_links(ground: Ground, contents: Contents, marks: Marks) -> dict[Figure | None, list[Added]]:
    bodies_of = dict(contents.moving)
    added: dict[Figure | None, list[Added]] = {
        figure: add_links(ground, figure.links, marks, bodies_of.get(figure))
        for figure in contents.figures
        if figure.links
    }
    if contents.doors:
        added[None] = add_links(ground, contents.doors, marks, None)
    return added


def _of_robots(count: int, marks: Marks) -> Any:
    flags = np.zeros(count, dtype=bool)
    for geom, _, body, _ in marks.entries:
        flags[geom.id] = body is not None
    return flags


def _begin(built: Built) -> None:
    """Set the poses of obstacles and robots; adapt the servos of a robot's base to the mass of its links."""
    built.put_obstacles()
    model, data = built.model, built.data
    for figure, (body, number) in built.figures.items():
        joints = model.body_jntadr[number]
        at, dof = model.jnt_qposadr[joints], model.jnt_dofadr[joints]
        servos = slice(3 * list(built.figures).index(figure), 3 * list(built.figures).index(figure) + 3)
        if figure.links:
            for axis, inertia in enumerate(model.dof_M0[dof : dof + 3].tolist()):
                gain, force = servo(axis, inertia)
                model.actuator_gainprm[servos][axis, 0] = gain
                model.actuator_biasprm[servos][axis, 2] = -gain
                model.actuator_forcerange[servos][axis] = -force, force
        body.attach(data.qpos[at : at + 3], data.qvel[dof : dof + 3], data.ctrl[servos])


def _add_obstacles(
    spec: Any, contents: Contents, moved: frozenset[Frame], marks: Marks
) -> tuple[dict[Frame, Any], dict[Frame, Pose]]:
    """Add all obstacles; return their bodies, and the poses of the fixed obstacles."""
    by_place: dict[Frame, list[Shape]] = {}
    for shape in contents.solids:
        by_place.setdefault(shape.place, []).append(shape)
    movable = frozenset(by_place) if not (contents.loose or contents.doors) else moved
    fixed = {place: place.ground_pose for place in by_place if place not in movable}
    stands = {
        place: _add_obstacle(spec, shapes, fixed.get(place), contents.moving, marks)
        for place, shapes in by_place.items()
    }
    return stands, fixed


def _add_obstacle(
    spec: Any,
    shapes: Iterable[Shape],
    pose: Pose | None,
    robots: Sequence[tuple[Figure, MujocoBody]],
    marks: Marks,
) -> Any:
    # MuJoCo fixes the pose of a body without mocap at compile time.
    added = spec.worldbody.add_body(mocap=pose is None, name=f"stand {len(marks.entries)}")
    if pose is not None:
        put(added.pos, added.quat, pose)
    for shape in shapes:
        low, high = shape.heights()
        bits = STANDING
        for index, (figure, body) in enumerate(robots):
            height = figure.place.height_m
            bottom, top = body.build.heights
            if low < top + height and bottom + height < high:
                bits |= own_bit(index)
        marks.note(add_geom(spec, added, shape, shape.local, Touch(bits, 0)), shape)
    return added


def _add_loose(spec: Any, thing: DynamicSolid, marks: Marks) -> Any:
    added = spec.worldbody.add_body(name=f"loose {len(marks.entries)}")
    added.add_freejoint()
    frame = thing.place.ground_pose.inverse
    touch = Touch(LOOSE, STANDING | LOOSE)
    geoms = [add_geom(spec, added, shape, frame.after(shape.pose), touch) for shape in thing.shapes]
    for geom, shape, density in zip(geoms, thing.shapes, thing.densities, strict=True):
        fill(geom, shape, density)
        marks.note(geom, shape)
    return added


def _add_robot(
    spec: Any,
    figure: Figure,
    body: MujocoBody,
    index: int,
    marks: Marks,
) -> Any:
    added = add_base(spec, body, figure.place.height_m, index)
    touch = Touch(ROBOTS, own_bit(index) | ROBOTS | LOOSE)
    for number, (shape, pose) in enumerate(zip(body.build.outline, body.poses, strict=True)):
        marks.note(add_geom(spec, added, shape, pose, touch), shape, body, 1 << number)
    return added
