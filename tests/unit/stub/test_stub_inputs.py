"""Battery, keyboard and joystick: each robot has them, and services of this project control them."""

import pytest

BATTERY = "battery [ 1 10 0 ] cpuConsumption 10"


def stepped(robot, *topics):
    """Enable the devices of these topics, make a step, and return the messages of each topic."""
    inboxes = [robot.inbox(topic) for topic in topics]
    for device in {topic.partition("/")[0] for topic in topics}:
        assert robot.get(f"{device}/enable", value=32) is True
    robot.call("robot/time_step", value=32)
    return inboxes


def test_pressed_keys_are_published_at_every_step_until_they_are_released(robot):
    """Each pressed key gives one message per step, as in Webots while a person holds the key."""
    assert robot.get("palaestra/keyboard/press", value=ord("W")) is True
    assert robot.get("palaestra/keyboard/press", value=ord("A")) is True
    (keys,) = stepped(robot, "keyboard/key")
    assert robot.get("palaestra/keyboard/release", value=ord("W")) is True
    robot.call("robot/time_step", value=32)
    assert robot.get("palaestra/keyboard/release", value=-1) is True
    robot.call("robot/time_step", value=32)

    assert keys == [87, 65, 65]


def test_a_keyboard_reports_seven_keys_at_most(robot):
    """Webots reports at most seven keys too."""
    answers = [robot.get("palaestra/keyboard/press", value=key) for key in range(65, 73)]

    assert answers == [True] * 7 + [False]
    assert robot.get("palaestra/keyboard/press", value=65) is True, "it is pressed already"
    assert robot.get("palaestra/keyboard/release", value=72) is False
    assert robot.get("palaestra/keyboard/press", value=-1) is False


def test_a_joystick_is_not_connected_until_somebody_moves_it(robot):
    """Clients check the connection first, and work without a joystick."""
    assert robot.get("joystick/is_connected") is False
    assert robot.get("joystick/get_number_of_axes") == -1
    (axis,) = stepped(robot, "joystick/axis0")

    assert axis == []


def test_a_moved_joystick_publishes_axes_points_of_view_and_pressed_buttons(robot):
    """As with the real controller, a step has one message about buttons, with the first pressed button."""
    assert robot.get("palaestra/joystick/set_axes", values=[100.0, -128.0]) is True
    assert robot.get("palaestra/joystick/set_povs", values=[1.0]) is True
    assert robot.get("palaestra/joystick/press", value=3) is True
    assert robot.get("palaestra/joystick/press", value=1) is True
    topics = "axis0", "axis1", "axis2", "pov0", "pressed_button"
    sent = stepped(robot, *(f"joystick/{topic}" for topic in topics))

    assert sent == [[100], [-128], [0], [1], [3]]
    assert robot.get("joystick/is_connected") is True
    assert robot.get("joystick/get_number_of_axes") == 6
    assert robot.get("joystick/get_number_of_povs") == 1
    assert robot.get("joystick/get_model") == "palaestra"


def test_no_pressed_button_is_a_message_too(robot):
    """A client that keeps the newest message learns that the button was released."""
    assert stepped(robot, "joystick/pressed_button") == [[-1]]


@pytest.mark.parametrize("values", [[1.0] * 7, [128.0], [float("nan")]])
def test_a_joystick_cannot_be_turned_beyond_its_range(robot, values):
    """The joystick has six axes with values from -128 to 127; a wrong value must not connect it."""
    assert robot.get("palaestra/joystick/set_axes", values=values) is False
    assert robot.get("joystick/is_connected") is False


def test_a_battery_loses_what_the_cpu_takes(start, world, simple_robot, ros):
    """A power of 10 W for 32 ms takes 0.32 J; the field and the sensor have the same value."""
    start(world(robot=simple_robot.replace("Robot {", f"Robot {{ {BATTERY}", 1)))
    robot = ros.node("robotino")
    (values,) = stepped(robot, "battery_sensor/value")
    robot.call("robot/time_step", value=32)

    node = robot.get("supervisor/get_self")
    field = robot.get("supervisor/node/get_field", node=node, fieldName="battery", proto=False)
    assert values == pytest.approx([0.68, 0.36])
    assert robot.get("supervisor/field/get_float", field=field, index=0) == pytest.approx(0.36)


def test_a_robot_with_an_empty_battery_stands_still_until_a_reset(start, world, simple_robot):
    """As in Webots, the robot is switched off; a reset restores the energy of the world file."""
    simulation = start(world(robot=simple_robot.replace("Robot {", f"Robot {{ {BATTERY}", 1))).simulation
    (robot,) = simulation.robots
    for motor in robot.motors.values():
        motor.set_position(float("inf"))
        motor.set_velocity(5.0)

    simulation.step(96)
    angles = [motor.angle_rad for motor in robot.motors.values()]
    simulation.step(32)
    assert robot.battery.value == 0.0
    simulation.step(32)
    assert [motor.angle_rad for motor in robot.motors.values()] == angles

    simulation.reset()
    simulation.step(32)
    assert robot.battery.value == 1.0


def test_a_robot_without_a_battery_reads_minus_1(robot):
    """Webots returns -1 too."""
    (values,) = stepped(robot, "battery_sensor/value")

    assert values == [-1.0]


def test_a_client_sends_what_a_robot_window_would(robot):
    """The controller receives each text once, in order; at most 100 texts wait."""
    for text in ("first", "second"):
        assert robot.get("palaestra/window/send_text", value=text) is True

    assert [robot.get("robot/wwi_receive_text") for _ in range(3)] == ["first", "second", ""]
    assert all(robot.get("palaestra/window/send_text", value="x") for _ in range(100))
    assert robot.get("palaestra/window/send_text", value="x") is False
