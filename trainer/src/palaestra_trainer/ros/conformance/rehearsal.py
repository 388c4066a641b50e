"""The claims about time, steps and resets: a client drives the cart of the world as a training does.

Each claim is a sentence with a function, which raises `Broken` if the claim does not hold. `CLAIMS` lists
them in their order. A reset comes before each function, so a wrong result affects no later claim.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final, Protocol

from palaestra_trainer.errors import SimulatorFault
from palaestra_trainer.ros.conformance.claims import FAILED, Answer, Claims, ClaimVerdict
from palaestra_trainer.ros.conformance.player import RosClient

DEVICES: Final = ("distance sensor", "left motor", "right motor")
_DEFINITION: Final = "CART"
_SENSOR: Final = "distance_sensor"
_WHEELS: Final = ("left_motor", "right_motor")
_AHEAD_M: Final = 1.35  # from the sensor to the wall at the start
_PLACE: Final = (0.5, 0.25)
_HEADING_RAD: Final = 1.0
_PAUSE, _FAST = 0, 2

# Tolerance of poses and distances: if bodies have masses, the cart does not stand exactly where it was set.
_WITHIN_M: Final = 0.02
_WITHIN_RAD: Final = 0.05
_WITHIN_S: Final = 1e-6
_MESSAGE_S: Final = 0.5  # the trainer has the same time limit for a sensor's message
_QUIET_S: Final = 0.1  # a second message would arrive within this time
_POLL_S: Final = 0.002
_STEPS: Final = 20
_SPEED_RAD_S: Final = 4.0  # drives 0.128 m in `_STEPS` steps of 32 ms


class Broken(Exception):
    """A claim does not hold; the text is the difference."""


class TrainingClient(RosClient, Protocol):
    """A client of ROS that also returns each message."""

    def messages(self, topic: str) -> Sequence[Any]:
        """Return the messages of a topic that have arrived since the last call.

        Raises:
            SimulatorFault: the publisher has closed the connection, or sends messages of another type.
        """
        ...


class Cart:
    """The cart of the world, driven by a client.

    Args:
        client: the client, which takes full names.
        asked: the claims, with the types of all services.
        name: the ROS name of the cart.
    """

    def __init__(self, client: TrainingClient, asked: Claims, name: str) -> None:
        self._client = client
        self._types = {path: kind for _, path, kind, _ in asked.calls}
        self._topics = asked.topics
        self._above = f"/{name}/"
        self.step_ms = asked.step_ms

    def ask(self, path: str, **request: Any) -> Answer:
        """Call a service that must succeed; return its response.

        Raises:
            Broken: the call fails.
        """
        answer = self._client.call(self._above + path, self._types[path], request)
        if FAILED in answer or not answer.get("success", 1):
            raise Broken(f"{path} fails: {answer.get(FAILED, 'it returns no success')}")
        return answer

    def begin(self) -> None:
        """Start an episode, as a training does at its start and after each reset."""
        self.ask("supervisor/simulation_set_mode", value=_FAST)
        self.ask(f"{_SENSOR}/enable", value=self.step_ms)
        self._client.listen(self._above + f"{_SENSOR}/value", self._topics[f"{_SENSOR}/value"])
        self.reset()

    def reset(self) -> None:
        """Reset the simulation, and release the motors."""
        self.ask("robot/set_custom_data", value='{"seed": 1}')
        self.ask("supervisor/simulation_reset", ask=True)
        self.step()
        for wheel in _WHEELS:
            self.ask(f"{wheel}/set_position", value=math.inf)
            self.ask(f"{wheel}/set_velocity", value=0.0)

    def step(self) -> float:
        """Step once, and return the distance to the wall.

        Raises:
            Broken: the step fails, or the sensor sends no message in time.
        """
        self.ask("robot/time_step", value=self.step_ms)
        end = time.monotonic() + _MESSAGE_S
        while not (arrived := self.arrived()):
            if time.monotonic() > end:
                raise Broken(
                    f"{_SENSOR}/value sends no message within {_MESSAGE_S:g} s after a step; send one message"
                    " of each enabled sensor right after the response to the step"
                )
            time.sleep(_POLL_S)
        return float(arrived[-1]["range"])

    def arrived(self) -> Sequence[Any]:
        """Return the messages of the sensor that have arrived since the last call."""
        return self._client.messages(self._above + f"{_SENSOR}/value")

    def drive(self, speed_rad_s: float) -> None:
        """Set the velocity of both wheels, and make some steps."""
        for wheel in _WHEELS:
            self.ask(f"{wheel}/set_velocity", value=speed_rad_s)
        for _ in range(_STEPS):
            self.step()

    def time_s(self) -> float:
        """Return the simulated time."""
        return float(self.ask("robot/get_time", ask=True)["value"])

    def node(self) -> int:
        """Return the handle of the cart."""
        node = self.ask("supervisor/get_from_def", name=_DEFINITION)["node"]
        if not node:
            raise Broken(f"get_from_def returns 0 for {_DEFINITION}; return a handle of the robot")
        return int(node)

    def field(self, name: str) -> int:
        """Return the handle of a field of the cart."""
        field = self.ask("supervisor/node/get_field", node=self.node(), fieldName=name)["field"]
        if not field:
            raise Broken(f"get_field returns 0 for {name}; return a handle of the field")
        return int(field)

    def pose(self) -> tuple[float, float, float]:
        """Return x and y in meters, and the heading in radians."""
        at = self.ask("supervisor/node/get_position", node=self.node())["position"]
        turn = self.ask("supervisor/node/get_orientation", node=self.node())["orientation"]
        heading = math.remainder(2.0 * math.atan2(turn["z"], turn["w"]), 2.0 * math.pi)
        return at["x"], at["y"], heading

    def require_pose(self, x_m: float, y_m: float, heading_rad: float) -> None:
        """Check the pose, with tolerances for bodies with masses.

        Raises:
            Broken: the cart is elsewhere.
        """
        x, y, heading = self.pose()
        turned = abs(math.remainder(heading - heading_rad, 2.0 * math.pi))
        if math.hypot(x - x_m, y - y_m) > _WITHIN_M or turned > _WITHIN_RAD:
            raise Broken(
                f"the cart is at x {x:.3f} m, y {y:.3f} m, heading {heading:.3f} rad instead of"
                f" {x_m:.3f}, {y_m:.3f}, {heading_rad:.3f}"
            )


def _lists_devices(cart: Cart) -> None:
    listed = sorted(cart.ask("robot/get_device_list", ask=1)["list"])
    count = cart.ask("robot/get_number_of_devices", ask=True)["value"]
    if listed != list(DEVICES) or count != len(DEVICES):
        raise Broken(f"lists {listed} and counts {count}; list {', '.join(DEVICES)} and count {len(DEVICES)}")


def _responds_in_pause(cart: Cart) -> None:
    cart.ask("supervisor/simulation_set_mode", value=_PAUSE)
    cart.time_s()
    cart.ask(f"{_SENSOR}/enable", value=cart.step_ms)
    cart.ask("supervisor/simulation_set_mode", value=_FAST)


def _lasts_its_period(cart: Cart) -> None:
    began_s = cart.time_s()
    for _ in range(_STEPS):
        cart.step()
    wanted_s, passed_s = _STEPS * cart.step_ms / 1000.0, cart.time_s() - began_s
    if abs(passed_s - wanted_s) > _WITHIN_S:
        raise Broken(
            f"{_STEPS} steps of {cart.step_ms} ms last {passed_s:.6f} s; simulate exactly the requested time"
        )


def _waits_for_steps(cart: Cart) -> None:
    began_s, began = cart.time_s(), cart.pose()
    time.sleep(_QUIET_S)
    if cart.time_s() != began_s or cart.pose() != began:
        raise Broken("time passes without a step; let it pass only between a time_step and its response")


def _sends_one_message(cart: Cart) -> None:
    for _ in range(_STEPS):
        cart.step()
    time.sleep(_QUIET_S)
    if more := len(cart.arrived()):
        raise Broken(f"{_STEPS} steps are followed by {more} more messages; send one for each step")


def _measures_the_wall(cart: Cart) -> None:
    found = cart.step()
    if abs(found - _AHEAD_M) > _WITHIN_M:
        raise Broken(f"measures {found:.3f} m instead of {_AHEAD_M:.3f} m at the start")


def _drives(cart: Cart) -> None:
    began = cart.step()
    cart.drive(_SPEED_RAD_S)
    x, _, _ = cart.pose()
    if x < _WITHIN_M:
        raise Broken(f"drives {x:.3f} m forward in {_STEPS} steps at {_SPEED_RAD_S:g} rad/s; move the robot")
    if cart.step() > began - _WITHIN_M:
        raise Broken("drives toward the wall, but the distance sensor measures the same distance")


def _returns(cart: Cart) -> None:
    cart.drive(_SPEED_RAD_S)
    cart.reset()
    cart.drive(0.0)
    cart.require_pose(0.0, 0.0, 0.0)


def _is_placed(cart: Cart) -> None:
    node, (x, y) = cart.node(), _PLACE
    translation, rotation = cart.field("translation"), cart.field("rotation")
    z = cart.ask("supervisor/field/get_vec3f", field=translation)["value"]["z"]
    turn = {"x": 0.0, "y": 0.0, "z": math.sin(0.5 * _HEADING_RAD), "w": math.cos(0.5 * _HEADING_RAD)}
    cart.ask("supervisor/field/set_vec3f", field=translation, value={"x": x, "y": y, "z": z})
    cart.ask("supervisor/field/set_rotation", field=rotation, value=turn)
    cart.ask("supervisor/node/reset_physics", node=node)
    cart.step()
    cart.require_pose(x, y, _HEADING_RAD)


CLAIMS: Final[Mapping[str, Callable[[Cart], None]]] = {
    "the list of devices is complete": _lists_devices,
    "a paused simulation responds": _responds_in_pause,
    "a step lasts its period": _lasts_its_period,
    "time passes only in steps": _waits_for_steps,
    "a step sends one message of each sensor": _sends_one_message,
    "the distance sensor measures the wall": _measures_the_wall,
    "the motors drive the robot": _drives,
    "a reset returns the robot to its start": _returns,
    "the supervisor places the robot": _is_placed,
}


def rehearsed(client: TrainingClient, asked: Claims, name: str) -> list[ClaimVerdict]:
    """Drive the cart, and return a verdict on each claim.

    Args:
        client: the client.
        asked: the claims of `TRAINING`.
        name: the ROS name of the cart.
    """
    cart = Cart(client, asked, name)
    return [ClaimVerdict(path=claim, type_name="", problem=_problem(cart, CLAIMS[claim])) for claim in CLAIMS]


def _problem(cart: Cart, check: Callable[[Cart], None]) -> str:
    try:
        cart.begin()
        check(cart)
    except (Broken, SimulatorFault) as problem:
        return str(problem)
    return ""
