"""A complete simulator for `driver: command`: a cart with two wheels and a distance sensor before a wall.

    python cart_simulator.py WORLD.wbt

The program takes only names from the world; its model of cart, room and sensor is the class `Room`. To
connect another simulator, replace `Room`. docs/howto/bring-a-simulator.md explains each service.

exit codes: 0 after SIGTERM; the status of `simulation_quit`; 1 no ROS master responds; 2 the world is wrong
"""

import argparse
import math
import os
import signal
import sys
from pathlib import Path
from typing import Any

from palaestra_sim.ros import Loop, MasterUnreachable, RosNode, ServiceFailed
from palaestra_sim.world import WorldError, robots

BASIC_MS = 32  # basicTimeStep of the world
DEVICES = ("left motor", "right motor", "distance sensor")
RANGE = {"radiation_type": 1, "field_of_view": 0.1, "min_range": 0.0, "max_range": 2.0}  # sensor_msgs/Range
WHEEL_M, AXLE_M, NOSE_M, WALL_M = 0.05, 0.3, 0.15, 1.5
NODES, FIELDS = {"CART": 1}, {"translation": 2, "rotation": 3}  # handles of the cart and of its fields
NO_MASTER, WRONG_WORLD = 1, 2  # exit codes


class Room:
    """The simulation: the pose of the cart in m and rad, and the velocities of its wheels in rad/s."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Return everything to its start, and stop."""
        self.time_ms = 0
        self.position = [0.0, 0.0, 0.0]
        self.heading = 0.0
        self.wheels = {"left motor": 0.0, "right motor": 0.0}

    def advance(self, period_ms: int) -> None:
        """Simulate a time; the wall stops the cart."""
        self.time_ms += period_ms
        left, right = (speed * WHEEL_M * period_ms / 1000.0 for speed in self.wheels.values())
        self.heading += 0.5 * (right - left) / AXLE_M
        x = self.position[0] + 0.5 * (left + right) * math.cos(self.heading)
        self.position[0] = min(x, WALL_M - NOSE_M)
        self.position[1] += 0.5 * (left + right) * math.sin(self.heading)
        self.heading += 0.5 * (right - left) / AXLE_M

    def distance(self) -> float:
        """Return the meters from the nose of the cart to the wall, at most the sensor's range."""
        ahead = math.cos(self.heading)
        free = (WALL_M - self.position[0]) / ahead - NOSE_M if ahead > 0.0 else math.inf
        return max(0.0, min(free, RANGE["max_range"]))


class CartSimulator:
    """The ROS node of the cart, which serves `Room`."""

    def __init__(self, name: str, master: str) -> None:
        self.room = Room()
        self.loop = Loop()
        self.status = 0
        self._node = RosNode(self.loop, name, master)
        self._range = self._node.advertise("distance_sensor/value", "sensor_msgs/Range", template=RANGE)
        self._sensor_ms = 0  # sampling period of the distance sensor; 0: not enabled

    def serve(self) -> None:
        """Register all services at once, so that a client that finds one of them finds all."""
        with self._node.together():
            self._serve("robot/time_step", "set_int", self._time_step)
            self._serve("robot/get_time", "get_float", lambda _: {"value": self.room.time_ms / 1000.0})
            self._serve("robot/get_number_of_devices", "get_int", lambda _: {"value": len(DEVICES)})
            self._serve("robot/set_custom_data", "set_string", lambda _: {"success": True})
            self._serve("supervisor/simulation_set_mode", "set_int", lambda _: {"success": True})
            self._serve("supervisor/simulation_reset", "get_bool", self._reset)
            self._serve("supervisor/simulation_quit", "set_int", self._quit)
            self._serve_devices()
            self._serve_nodes()
            self._serve("robot/get_device_list", "robot_get_device_list", lambda _: {"list": DEVICES})

    def end(self, status: int) -> None:
        """Let the loop end after the current response."""
        self.status = status
        self.loop.later(0.0, self.loop.stop)

    def close(self) -> None:
        """Unregister the node."""
        self._node.close()

    def _serve_devices(self) -> None:
        self._serve("distance_sensor/enable", "set_int", self._enable)
        for motor in self.room.wheels:
            path = motor.replace(" ", "_")
            self._serve(f"{path}/set_position", "set_float", lambda it: {"success": math.isinf(it.value)})
            self._serve(f"{path}/set_velocity", "set_float", lambda it, motor=motor: self._turn(motor, it))

    def _serve_nodes(self) -> None:
        node, field = "supervisor/node", "supervisor/field"
        self._serve("supervisor/get_from_def", "supervisor_get_from_def", self._find)
        self._serve(f"{node}/get_field", "node_get_field", lambda it: {"field": FIELDS.get(it.fieldName, 0)})
        self._serve(f"{node}/get_position", "node_get_position", lambda _: {"position": self._point()})
        self._serve(f"{node}/get_orientation", "node_get_orientation", self._orientation)
        self._serve(f"{node}/reset_physics", "node_reset_functions", self._stop)
        self._serve(f"{field}/get_vec3f", "field_get_vec3f", lambda _: {"value": self._point()})
        self._serve(f"{field}/set_vec3f", "field_set_vec3f", self._move)
        self._serve(f"{field}/set_rotation", "field_set_rotation", self._rotate)

    def _serve(self, path: str, type_name: str, handler: Any) -> None:
        self._node.serve(path, f"webots_ros/{type_name}", handler)

    def _time_step(self, request: Any) -> dict[str, bool]:
        if request.value <= 0 or request.value % BASIC_MS:
            return {"success": False}
        self.room.advance(request.value)
        self.loop.later(0.0, self._publish)  # after the response
        return {"success": True}

    def _publish(self) -> None:
        if self._sensor_ms and self.room.time_ms % self._sensor_ms == 0:
            self._range.send_value(self.room.distance(), self.room.time_ms * 1_000_000)

    def _enable(self, request: Any) -> dict[str, bool]:
        if request.value < 0 or request.value % BASIC_MS:
            return {"success": False}
        self._sensor_ms = request.value
        return {"success": True}

    def _turn(self, motor: str, request: Any) -> dict[str, bool]:
        self.room.wheels[motor] = request.value
        return {"success": True}

    def _reset(self, _: Any) -> dict[str, bool]:
        self.room.reset()
        return {"value": True}

    def _quit(self, request: Any) -> dict[str, bool]:
        self.end(request.value)
        return {"success": True}

    def _find(self, request: Any) -> dict[str, int]:
        return {"node": NODES.get(request.name, 0)}  # 0: the world has no such node

    def _stop(self, _: Any) -> dict[str, int]:
        return {"success": 1}  # this cart has no inertia

    def _point(self) -> dict[str, float]:
        return dict(zip("xyz", self.room.position, strict=True))

    def _orientation(self, _: Any) -> dict[str, dict[str, float]]:
        half = 0.5 * self.room.heading
        return {"orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}}

    def _move(self, request: Any) -> dict[str, int]:
        if request.field != FIELDS["translation"]:
            raise ServiceFailed(f"field {request.field} is not a translation; ask get_field for its handle")
        self.room.position = [request.value.x, request.value.y, request.value.z]
        return {"success": 1}

    def _rotate(self, request: Any) -> dict[str, int]:
        self.room.heading = 2.0 * math.atan2(request.value.z, request.value.w)
        return {"success": 1}


def main() -> int:
    """Simulate until a signal or a client ends the program; return the exit code."""
    parser = argparse.ArgumentParser(description="A cart in a room, as a simulator for driver command.")
    parser.add_argument("world", type=Path, help="the world, which has the ROS name of the cart")
    world = parser.parse_args().world
    try:
        [name] = [robot.ros_name for robot in robots(world.read_bytes(), world.name)]
        simulator = CartSimulator(name or "cart", os.environ.get("ROS_MASTER_URI", "http://localhost:11311"))
        simulator.serve()
    except MasterUnreachable as error:
        sys.stderr.write(f"{error}; start palaestra-ros-master\n")
        return NO_MASTER
    except WorldError as error:
        sys.stderr.write(f"{error}\n")
        return WRONG_WORLD
    except OSError as error:
        sys.stderr.write(f"{world}: {error.strerror}; name a world that can be read\n")
        return WRONG_WORLD
    except ValueError:
        sys.stderr.write(f'{world}: not exactly one robot has controller "ros"; use the world in cart.yaml\n')
        return WRONG_WORLD
    simulator.loop.wake_on_signals()
    signal.signal(signal.SIGTERM, lambda *_: simulator.loop.post(lambda: simulator.end(0)))
    simulator.loop.run()
    simulator.close()
    return simulator.status


if __name__ == "__main__":
    sys.exit(main())
