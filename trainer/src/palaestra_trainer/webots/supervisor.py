"""Change a simulation through its supervisor."""

from __future__ import annotations

import contextlib

from palaestra_trainer.errors import SimulatorDead, WrongData
from palaestra_trainer.ros import call_together
from palaestra_trainer.webots.fields import Value, encoded, kind_of, turn_about_z
from palaestra_trainer.webots.observer import Mode, Observer
from palaestra_trainer.webots.services import Services

Vector = tuple[float, float, float]


class Supervisor:
    """Changes the simulation through the supervisor's controller.

    Every method raises SimulatorDead, SimulatorHung or WrongData. Changes of fields take effect in the next
    step.

    Args:
        node_name: the ROS name of the supervisor.
        observer: the observer, which provides handles of nodes and fields.

    Attributes:
        paused: whether the simulator has confirmed that it is paused; False if that is unknown.
    """

    def __init__(self, node_name: str, observer: Observer) -> None:
        self.node_name = node_name
        self.paused = False
        self._observer = observer
        self._services = Services(node_name)

    def set_mode(self, mode: Mode) -> None:
        """Set the mode of simulated time.

        Raises:
            WrongData: also if the simulator refuses the mode.
        """
        self.paused = False
        if not self._services.get("supervisor/simulation_set_mode", "set_int")(value=int(mode)).success:
            raise WrongData(self.node_name, f"refuses mode {int(mode)}; use Webots R2021a or later")
        self.paused = mode == Mode.PAUSE

    def reset(self) -> None:
        """Reset the simulation in the next step; enabled sensors stay enabled."""
        self._services.ask("supervisor/simulation_reset", "get_bool")

    def reload(self) -> None:
        """Reload the world; controllers restart, so all connections must be opened again."""
        # The response may be lost, because the controller that sends it restarts too.
        with contextlib.suppress(SimulatorDead):
            self._services.ask("supervisor/world_reload", "get_bool")
        self._observer.close()
        self._services.close()

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
        where = f"{name}.{field}"
        kind = kind_of(self._observer.field_type(name, field), where)
        wire = encoded(kind, where, value)
        service = self._services.get(f"supervisor/field/set_{kind.name}", f"field_set_{kind.name}")
        service(field=self._observer.field(name, field), index=index, value=wire)

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
        return (linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z)

    def set_velocity(self, name: str, linear: Vector, angular: Vector = (0.0, 0.0, 0.0)) -> None:
        """Set the linear (m/s) and angular (rad/s) velocity of the node with DEF `name`, in world axes."""
        service = self._services.get("supervisor/node/set_velocity", "node_set_velocity")
        wanted = {
            "linear": dict(zip("xyz", linear, strict=True)),
            "angular": dict(zip("xyz", angular, strict=True)),
        }
        service(node=self._observer.node(name), velocity=wanted)

    def close(self) -> None:
        """Close the connections and reset `paused`."""
        self.paused = False
        self._services.close()
