"""Change a simulation through its supervisor."""

from __future__ import annotations

import contextlib
from pathlib import Path

from palaestra_trainer.errors import SimulatorDead, WrongData
from palaestra_trainer.ros import call_together
from palaestra_trainer.webots.fields import Value, encoded, kind_of, turn_about_z
from palaestra_trainer.webots.observer import Mode, Observer
from palaestra_trainer.webots.supervised_view import SupervisedView
from palaestra_trainer.webots.world_node import Vector, tracks


class Supervisor(SupervisedView):
    """Changes the simulation through the supervisor's controller.

    Every method may raise SimulatorDead, SimulatorHung or WrongData. The stub and MuJoCo refuse a call that
    they cannot carry out. Webots confirms most of such calls, and reports the failure in its console. Changes
    of fields take effect in the next step.

    Args:
        node_name: the ROS name of the supervisor.
        observer: the observer, which provides handles of nodes and fields.

    Attributes:
        paused: whether the simulator has confirmed that it is paused; False if that is unknown.
    """

    def __init__(self, node_name: str, observer: Observer) -> None:
        super().__init__(node_name, observer)
        self.paused = False
        self._inserted = False

    def set_mode(self, mode: Mode) -> None:
        """Set the mode of simulated time.

        Raises:
            WrongData: also if the simulator refuses the mode.
        """
        self.paused = False
        refused = f"refuses mode {int(mode)}; use Webots R2021a or later"
        self._services.confirm("supervisor/simulation_set_mode", "set_int", refused, value=int(mode))
        self.paused = mode == Mode.PAUSE

    def reset(self) -> None:
        """Reset the simulation in the next step; enabled sensors stay enabled."""
        self._services.ask("supervisor/simulation_reset", "get_bool")
        if self._inserted:  # a reset removes inserted nodes, so their handles become invalid
            self._inserted = False
            self._observer.forget_handles()

    def reset_physics(self) -> None:
        """Stop all motion in the world."""
        self._services.ask("supervisor/simulation_reset_physics", "get_bool")

    def reload(self) -> None:
        """Reload the world; controllers restart, so all connections must be opened again.

        The old controllers may respond for a moment; `Webots.reload` waits until the new ones respond.
        """
        # The response may be lost, because the controller that sends it restarts too.
        with contextlib.suppress(SimulatorDead):
            self._services.ask("supervisor/world_reload", "get_bool")
        self._observer.close()
        self._services.close()

    def load_world(self, path: str | Path) -> None:
        """Load another world file of the simulator's machine; all connections must be opened again.

        The supervisor of the new world must have the same ROS name.

        Raises:
            WrongData: also if the simulator refuses the world; it then keeps the old world.
        """
        service = self._services.get("supervisor/world_load", "set_string")
        service.begin(value=str(path))
        # The response may be lost, as in `reload`.
        with contextlib.suppress(SimulatorDead):
            if not service.finish().success:
                raise WrongData(self.node_name, f"refuses world_load for {path}")
        self._observer.close()
        self._services.close()

    def save_world(self, path: str | Path) -> None:
        """Save the world, as it is now, as a file on the simulator's machine; only Webots can do this.

        Args:
            path: the file, whose name ends in .wbt; an absolute path.
        """
        self._confirm("world_save", "set_string", path, value=str(path))

    def quit(self, status: int = 0) -> None:
        """End the simulator with an exit status."""
        try:
            self._services.get("supervisor/simulation_quit", "set_int")(value=status)
        finally:
            self._services.close()

    def set_seed(self, seed: int) -> None:
        """Set the seed for the next reset, through the robot's customData."""
        self._services.get("robot/set_custom_data", "set_string")(value=f'{{"seed": {seed}}}')

    def place(self, name: str, x_m: float, y_m: float, heading_rad: float | None = None) -> None:
        """Move the node with DEF `name` on the floor, turn it unless the heading is None, and stop it."""
        height = self._observer.translation(name)[2]
        setters = [
            (
                self._services.get("supervisor/field/set_vec3f", "field_set_vec3f"),
                {
                    "field": self._observer.field(name, "translation"),
                    "value": {"x": x_m, "y": y_m, "z": height},
                },
            )
        ]
        if heading_rad is not None:
            setters.append(
                (
                    self._services.get("supervisor/field/set_rotation", "field_set_rotation"),
                    {
                        "field": self._observer.field(name, "rotation"),
                        "value": turn_about_z(heading_rad),
                    },
                )
            )
        call_together(setters)

    def stop_inertia(self, name: str) -> None:
        """Stop all motion of the node with DEF `name` and of its child nodes."""
        service = self._services.get("supervisor/node/reset_physics", "node_reset_functions")
        service(node=self._observer.node(name))

    def restart_controller(self, name: str) -> None:
        """Restart the controller of the robot with DEF `name`; its connections must be opened again."""
        self._confirm("node/restart_controller", "node_reset_functions", name, node=self._observer.node(name))

    def track_field(self, name: str, field: str, period_ms: int) -> None:
        """Make Webots send a field of one value every `period_ms`, so that reading it takes less time.

        A period of 0 ends this. The stub and MuJoCo confirm the call, and are as fast without it.
        """
        where, handle = f"{name}.{field}", self._observer.field(name, field)
        if tracks(period_ms):
            wanted = {"field": handle, "sampling_period": period_ms}
            self._confirm("field/enable_sf_tracking", "field_enable_sf_tracking", where, **wanted)
        else:
            self._confirm("field/disable_sf_tracking", "field_disable_sf_tracking", where, field=handle)

    def get_field(self, name: str, field: str, index: int = 0) -> Value:
        """Return the value of a field of the node with DEF `name`, in the type of the field.

        The value is a bool, int, float or str, or a tuple. The tuple is a vector (x, y or x, y, z), a color
        (red, green, blue), or a rotation: x, y, z of its axis and the angle in radians. `index` selects a
        value of a field with several values.

        Raises:
            ConfigurationError: the field holds nodes.
            WrongData: also if the node, field or index does not exist.
        """
        where = f"{name}.{field}"
        kind = kind_of(self._observer.field_type(name, field), where)
        service = self._services.get(f"supervisor/field/get_{kind.name}", f"field_get_{kind.name}")
        return kind.from_wire(service(field=self._observer.field(name, field), index=index).value)

    def set_field(self, name: str, field: str, value: Value, index: int = 0) -> None:
        """Write `value`, in the form that `get_field` returns, to a field of the node with DEF `name`.

        Raises:
            ConfigurationError: the field holds nodes, or values of another type.
            WrongData: also if the node or field does not exist, or the simulator refuses the write.
        """
        kind, request = self._field_value(name, field, value)
        self._services.get(f"supervisor/field/set_{kind}", f"field_set_{kind}")(index=index, **request)

    def insert_value(self, name: str, field: str, value: Value, index: int = -1) -> None:
        """Insert a value into a field, with several values, of the node with DEF `name`.

        Args:
            name: the DEF name of the node.
            field: the name of a field with several values, such as "point".
            value: the value, in the form that `get_field` returns.
            index: the position of the new value; -1: after the last value.

        Raises:
            ConfigurationError: the field holds nodes, or values of another type.
            WrongData: also if the field has only one value, or the simulator refuses the write.
        """
        kind, request = self._field_value(name, field, value)
        self._confirm(f"field/insert_{kind}", f"field_set_{kind}", f"{name}.{field}", index=index, **request)

    def remove_value(self, name: str, field: str, index: int = -1) -> None:
        """Remove a value, or a node, from a field with several values; `index` -1 is the last.

        Raises:
            WrongData: also if the field has no such value.
        """
        handle = self._observer.field(name, field)
        self._confirm("field/remove", "field_remove", f"{name}.{field}", field=handle, index=index)
        self._observer.forget_handles()

    def set_joint(self, name: str, position: float) -> None:
        """Move the joint with DEF `name` to a position in radians or meters, at rest.

        Raises:
            WrongData: also if the joint does not exist, or the position is outside the joint's stops.
        """
        service = self._services.get("supervisor/node/set_joint_position", "node_set_joint_position")
        service(node=self._observer.node(name), position=position, index=1)

    def velocity(self, name: str) -> tuple[Vector, Vector]:
        """Return the linear (m/s) and angular (rad/s) velocity of the node with DEF `name`, in world axes."""
        service = self._services.get("supervisor/node/get_velocity", "node_get_velocity")
        twist = service(node=self._observer.node(name)).velocity
        linear, angular = twist.linear, twist.angular
        speeds = (linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z)
        self._services.require_finite(f"the velocity of {name}", *speeds[0], *speeds[1])
        return speeds

    def set_velocity(self, name: str, linear: Vector, angular: Vector = (0.0, 0.0, 0.0)) -> None:
        """Set the linear (m/s) and angular (rad/s) velocity of the node with DEF `name`, in world axes."""
        service = self._services.get("supervisor/node/set_velocity", "node_set_velocity")
        wanted = {"linear": _xyz(linear), "angular": _xyz(angular)}
        service(node=self._observer.node(name), velocity=wanted)

    def add_force(
        self, name: str, force: Vector, *, offset: Vector | None = None, relative: bool = False
    ) -> None:
        """Push the node with DEF `name` with a force in N during the next basic step.

        Args:
            name: the DEF name of a Solid or robot with physics.
            force: x, y, z in N.
            offset: the point at which the force acts, in meters in the axes of the node; None: the center of
                mass.
            relative: whether the force is in the axes of the node; if not, it is in the axes of the world.

        Raises:
            WrongData: also if the simulator does not simulate forces (the stub does not).
        """
        push = {"node": self._observer.node(name), "force": _xyz(force), "relative": relative}
        if offset is None:
            self._confirm("node/add_force", "node_add_force_or_torque", name, **push)
        else:
            self._confirm(
                "node/add_force_with_offset", "node_add_force_with_offset", name, **push, offset=_xyz(offset)
            )

    def add_torque(self, name: str, torque: Vector, *, relative: bool = False) -> None:
        """Turn the node with DEF `name` with a torque in N m during the next basic step; see `add_force`."""
        wanted = {"node": self._observer.node(name), "force": _xyz(torque), "relative": relative}
        self._confirm("node/add_torque", "node_add_force_or_torque", name, **wanted)

    def save_state(self, name: str, state: str = "saved") -> None:
        """Save the poses of the node with DEF `name` and of the nodes inside it, for `load_state`."""
        self._confirm(
            "node/save_state", "node_set_string", name, node=self._observer.node(name), state_name=state
        )

    def load_state(self, name: str, state: str = "saved") -> None:
        """Restore the poses that `save_state` has saved; the nodes are then at rest.

        The state `__init__` is that of the world file.

        Raises:
            WrongData: also if no such state was saved.
        """
        self._confirm(
            "node/load_state", "node_set_string", name, node=self._observer.node(name), state_name=state
        )

    def insert_node(self, name: str, field: str, text: str, index: int = -1) -> None:
        """Insert nodes, as text of a world file, into a field of the node with DEF `name`.

        Args:
            name: the DEF name of the node; "": the world itself.
            field: the field, such as "children".
            text: one or more nodes, in the syntax of a world file.
            index: the position in the field; -1: after the last node.

        Raises:
            WrongData: also if the text is wrong, or the simulator cannot add such nodes.
        """
        self._confirm(
            "field/import_node_from_string",
            "field_import_node_from_string",
            f"{name}.{field}",
            field=self._observer.field(name, field),
            position=index,
            nodeString=text,
        )
        self._inserted = True
        self._observer.forget_handles()

    def remove_node(self, name: str) -> None:
        """Remove the node with DEF `name`; a reset does not restore it.

        Raises:
            WrongData: also if the simulator cannot continue without the node.
        """
        self._confirm("node/remove", "node_remove", name, node=self._observer.node(name))
        self._observer.forget_handles()

    def close(self) -> None:
        """Close the connections and reset `paused`."""
        self.paused = False
        self._services.close()

    def _field_value(self, name: str, field: str, value: Value) -> tuple[str, dict[str, object]]:
        """Return the name of a field's type, and the request that writes a value to the field.

        Raises:
            ConfigurationError: the field cannot hold the value.
        """
        where = f"{name}.{field}"
        kind = kind_of(self._observer.field_type(name, field), where)
        wire = encoded(kind, where, value)
        return kind.name, {"field": self._observer.field(name, field), "value": wire}


def _xyz(vector: Vector) -> dict[str, float]:
    return dict(zip("xyz", vector, strict=True))
