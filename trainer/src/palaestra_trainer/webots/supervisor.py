"""What changes a simulation."""

from __future__ import annotations

import contextlib

from palaestra_trainer.errors import SimulatorDead, WrongData
from palaestra_trainer.ros import call_together
from palaestra_trainer.webots.fields import Value, encoded, kind_of, turn_about_z
from palaestra_trainer.webots.observer import Mode, Observer
from palaestra_trainer.webots.services import Services

Vector = tuple[float, float, float]


class Supervisor:
    """Changes, through the supervisor's controller.

    Every method raises SimulatorDead, SimulatorHung or WrongData. Field changes take effect with the next
    step.

    Args:
        node_name: the ROS name of the supervisor.
        observer: where node and field handles are looked up.

    Attributes:
        paused: whether time stands, as the simulator has confirmed it; False while that is not known.
    """

    def __init__(self, node_name: str, observer: Observer) -> None:
        self.node_name = node_name
        self.paused = False
        self._observer = observer
        self._services = Services(node_name)

    def set_mode(self, mode: Mode) -> None:
        """Let time pass as `mode` says.

        Raises:
            WrongData: also when the simulator refuses the mode.
        """
        self.paused = False
        if not self._services.get("supervisor/simulation_set_mode", "set_int")(value=int(mode)).success:
            raise WrongData(self.node_name, f"refuses mode {int(mode)}; use Webots R2021a or later")
        self.paused = mode == Mode.PAUSE

    def reset(self) -> None:
        """Bring the simulation back to its start within the next step; enabled sensors stay enabled."""
        self._services.ask("supervisor/simulation_reset", "get_bool")

    def reload(self) -> None:
        """Load the world anew; controllers restart, and everything must be connected again."""
        # The answer may be lost with the controller that gave it.
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
        """Give the simulation the seed that it takes at the next reset, by way of the robot's customData."""
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
        """Take all speed from the node with DEF `name` and what hangs on it."""
        service = self._services.get("supervisor/node/reset_physics", "node_reset_functions")
        service(node=self._observer.node(name))

    def get_field(self, name: str, field: str, index: int = 0) -> Value:
        """Return the value of a field of the node with DEF `name`, as the type that the field has.

        A bool, int, float or str; x, y (, z) or red, green, blue; a rotation as x, y, z of its axis and the
        angle in radians. `index` chooses one of a field of several values.

        Raises:
            ConfigurationError: the field holds nodes.
            WrongData: also when there is no such node, field or index.
        """
        where = f"{name}.{field}"
        kind = kind_of(self._observer.field_type(name, field), where)
        service = self._services.get(f"supervisor/field/get_{kind.name}", f"field_get_{kind.name}")
        return kind.from_wire(service(field=self._observer.field(name, field), index=index).value)

    def set_field(self, name: str, field: str, value: Value, index: int = 0) -> None:
        """Write a field of the node with DEF `name`; `value` is what `get_field` returns.

        Raises:
            ConfigurationError: the field holds nodes, or values of another type.
            WrongData: also when there is no such node or field, or the simulator refuses the write.
        """
        where = f"{name}.{field}"
        kind = kind_of(self._observer.field_type(name, field), where)
        wire = encoded(kind, where, value)
        service = self._services.get(f"supervisor/field/set_{kind.name}", f"field_set_{kind.name}")
        service(field=self._observer.field(name, field), index=index, value=wire)

    def velocity(self, name: str) -> tuple[Vector, Vector]:
        """Return the linear (m/s) and angular (rad/s) velocity of the node with DEF `name`, in world axes."""
        service = self._services.get("supervisor/node/get_velocity", "node_get_velocity")
        twist = service(node=self._observer.node(name)).velocity
        linear, angular = twist.linear, twist.angular
        return (linear.x, linear.y, linear.z), (angular.x, angular.y, angular.z)

    def set_velocity(self, name: str, linear: Vector, angular: Vector = (0.0, 0.0, 0.0)) -> None:
        """Give the node with DEF `name` a linear (m/s) and an angular (rad/s) velocity, in world axes."""
        service = self._services.get("supervisor/node/set_velocity", "node_set_velocity")
        wanted = {
            "linear": dict(zip("xyz", linear, strict=True)),
            "angular": dict(zip("xyz", angular, strict=True)),
        }
        service(node=self._observer.node(name), velocity=wanted)

    def close(self) -> None:
        """Drop the connections, and what was confirmed over them."""
        self.paused = False
        self._services.close()
