"""The claims about time, steps and resets, with a cart in this process that breaks one of them."""

import math

import pytest

from palaestra_trainer.errors import WrongData
from palaestra_trainer.ros.conformance.claims import claims
from palaestra_trainer.ros.conformance.rehearsal import CLAIMS, rehearsed

ASKED = claims("training")
DEVICES = ["left motor", "right motor", "distance sensor"]


@pytest.fixture(autouse=True)
def short_waits(monkeypatch):
    """This cart responds at once, so no check has to wait."""
    monkeypatch.setattr("palaestra_trainer.ros.conformance.rehearsal._MESSAGE_S", 0.01)
    monkeypatch.setattr("palaestra_trainer.ros.conformance.rehearsal._QUIET_S", 0.001)


class CartInPlace:
    """A client with a cart of its own; it drives along x only."""

    def __init__(self):
        self.sent = []
        self.subscribed = set()
        self.reset()

    def reset(self):
        """Return to the start."""
        self.x, self.y, self.heading, self.speed = 0.0, 0.0, 0.0, 0.0

    time_s = 0.0

    def call(self, path, type_name, request):
        """Respond with the method of the service's name, or with a success."""
        assert type_name
        service = path.rpartition("/")[2]
        return getattr(self, service, lambda **_: {"success": True})(**request)

    def listen(self, topic, type_name):
        """Note the topic."""
        assert type_name == "sensor_msgs/Range"
        self.subscribed.add(topic)

    def heard(self):
        """Return no messages, because the rehearsal asks for all of them."""
        return {}

    def messages(self, topic):
        """Return the new messages, if the topic is subscribed."""
        new, self.sent = self.sent, []
        return new if topic in self.subscribed else []

    def time_step(self, value):
        """Drive, and send one message."""
        self.time_s += value / 1000.0
        self.x += 0.05 * self.speed * value / 1000.0
        self.send()
        return {"success": True}

    def send(self):
        """Send the distance to the wall."""
        self.sent.append({"range": 1.35 - self.x})

    def get_time(self, **_):
        """Return the simulated time."""
        return {"value": self.time_s}

    def get_device_list(self, **_):
        """Return the names of the devices."""
        return {"list": DEVICES}

    def get_number_of_devices(self, **_):
        """Return the number of the devices."""
        return {"value": len(DEVICES)}

    def simulation_reset(self, **_):
        """Return to the start."""
        self.reset()
        return {"value": True}

    def set_velocity(self, value):
        """Set the speed of both wheels."""
        self.speed = value
        return {"success": True}

    def get_from_def(self, **_):
        """Return a handle."""
        return {"node": 1}

    def get_field(self, **_):
        """Return a handle."""
        return {"field": 2}

    def get_vec3f(self, **_):
        """Return the translation."""
        return {"value": {"x": self.x, "y": self.y, "z": 0.0}}

    def set_vec3f(self, field, value):
        """Move the cart."""
        assert field
        self.x, self.y = value["x"], value["y"]
        return {"success": 1}

    def set_rotation(self, field, value):
        """Turn the cart."""
        assert field
        self.heading = 2.0 * math.atan2(value["z"], value["w"])
        return {"success": 1}

    def get_position(self, **_):
        """Return the position."""
        return {"position": {"x": self.x, "y": self.y, "z": 0.0}}

    def get_orientation(self, **_):
        """Return the rotation."""
        half = 0.5 * self.heading
        return {"orientation": {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}}


def problems(cart):
    """Return the problem of each claim that the cart breaks."""
    return {verdict.path: verdict.problem for verdict in rehearsed(cart, ASKED, "cart") if verdict.problem}


def test_a_cart_that_does_everything_right_keeps_every_claim():
    """If this cart had a mistake, the tests below could find it instead of the mistake that they plant."""
    verdicts = rehearsed(CartInPlace(), ASKED, "cart")

    assert [verdict.path for verdict in verdicts] == list(CLAIMS)
    assert problems(CartInPlace()) == {}


def repeated(cart):
    """Send each message twice, and let the second one arrive after the first one was read."""
    step = cart.time_step
    cart.time_step = lambda value: (step(value), cart.sent.append(cart.sent[-1]))[0]
    cart.messages = lambda _: [cart.sent.pop()] if cart.sent else []


def by_itself(cart):
    """Let time pass at each request."""

    def get_time(**_):
        cart.time_s += 0.001
        return {"value": cart.time_s}

    cart.get_time = get_time


def longer(cart):
    """Simulate one more millisecond in each step."""
    step = cart.time_step
    cart.time_step = lambda value: step(value + 1)


@pytest.mark.parametrize(
    ("break_", "claim", "problem"),
    [
        (
            lambda it: setattr(it, "get_number_of_devices", lambda **_: {"value": 2}),
            "the list of devices is complete",
            "counts 2; list distance sensor, left motor, right motor and count 3",
        ),
        (longer, "a step lasts its period", "20 steps of 32 ms last 0.660000 s; simulate exactly the"),
        (by_itself, "time passes only in steps", "let it pass only between a time_step and its response"),
        (repeated, "a step sends one message of each sensor", "more messages; send one for each step"),
        (
            lambda it: setattr(it, "send", lambda: it.sent.append({"range": 1.0})),
            "the distance sensor measures the wall",
            "measures 1.000 m instead of 1.350 m at the start",
        ),
        (
            lambda it: setattr(it, "send", lambda: it.sent.append({"range": 1.35})),
            "the motors drive the robot",
            "the distance sensor measures the same distance",
        ),
        (
            lambda it: setattr(it, "set_velocity", lambda **_: {"success": True}),
            "the motors drive the robot",
            "drives 0.000 m forward in 20 steps at 4 rad/s; move the robot",
        ),
        (
            lambda it: setattr(it, "simulation_reset", lambda **_: {"value": True}),
            "a reset returns the robot to its start",
            "instead of 0.000, 0.000, 0.000",
        ),
        (
            lambda it: setattr(it, "set_rotation", lambda **_: {"success": 1}),
            "the supervisor places the robot",
            "heading 0.000 rad instead of 0.500, 0.250, 1.000",
        ),
        (
            lambda it: setattr(it, "get_from_def", lambda **_: {"node": 0}),
            "the supervisor places the robot",
            "get_from_def returns 0 for CART; return a handle of the robot",
        ),
        (
            lambda it: setattr(it, "get_field", lambda **_: {"field": 0}),
            "the supervisor places the robot",
            "get_field returns 0 for translation; return a handle of the field",
        ),
    ],
)
def test_a_broken_claim_is_named_with_its_remedy(break_, claim, problem):
    """The author of a simulator reads one sentence for each claim that does not hold."""
    cart = CartInPlace()
    break_(cart)

    assert problem in problems(cart)[claim]


@pytest.mark.parametrize(
    ("service", "answer", "problem"),
    [
        ("enable", {"success": False}, "distance_sensor/enable fails: it returns no success"),
        ("simulation_reset", {"failed": "no node serves it"}, "simulation_reset fails: no node serves it"),
        ("time_step", {"success": True}, "distance_sensor/value sends no message within 0.01 s after a step"),
    ],
)
def test_a_service_that_fails_breaks_each_claim_that_needs_it(service, answer, problem):
    """Every claim begins with a reset, a step and an enabled sensor."""
    cart = CartInPlace()
    setattr(cart, service, lambda **_: answer)

    found = problems(cart)

    assert found.keys() == CLAIMS.keys()
    assert all(problem in text for text in found.values())


def test_a_connection_that_breaks_is_a_problem_of_its_claim():
    """A publisher of another type closes the connection; the program must not end with a traceback."""
    cart = CartInPlace()

    def lost(_topic):
        raise WrongData("cart", "the topic has another md5sum")

    cart.messages = lost

    assert all("another md5sum" in text for text in problems(cart).values())
