"""The services of a robot are exactly those in the table of Webots R2023b."""

from pathlib import Path

import pytest

from tests.tables import for_each

TABLE = Path(__file__).with_name("interface_r2023b.txt")
DEVICES = {
    "<distance>": ["ir1", "ir9"],
    "<touch>": ["touch_sensor"],
    "<position>": ["wheel1_joint_sensor"],
    "<motor>": ["wheel0_joint", "wheel2_joint"],
    "<sensor>": ["ir1", "ir9", "touch_sensor", "wheel1_joint_sensor"],
    "<dev>": ["ir1", "ir9", "touch_sensor", "wheel1_joint_sensor", "wheel0_joint", "wheel2_joint"],
}


def rows():
    """Yield the rows of the table, with the devices of the built-in arena in place of the variables."""
    for line in TABLE.read_text().splitlines():
        if line.startswith("#"):
            continue
        path, type_name = line.split()
        first, _, rest = path.partition("/")
        for name in DEVICES.get(first, [first]):
            yield f"{name}/{rest}", f"webots_ros/{type_name}"


def is_linear(path):
    """Return whether a service belongs to linear motors, which have forces instead of torques."""
    return path.endswith("_force") and not path.startswith("supervisor/")


@for_each("path, type_name", [row for row in rows() if not is_linear(row[0])])
def test_every_service_of_the_table_is_served_with_its_type(robot, path, type_name):
    """Some types have the same md5, and a client distinguishes them only by their names."""
    service, _ = robot.services[path]

    assert service.name == type_name


def test_nothing_is_served_that_the_table_does_not_have(robot):
    """A client that works with the stub must not depend on a service that Webots lacks."""
    known = {path for path, _ in rows()}
    listed = {"robot", "supervisor", *DEVICES["<dev>"]}

    served = {path for path in robot.services if path.split("/")[0] in listed}

    assert served <= known


def test_a_rotational_motor_has_no_services_for_force(robot):
    """A client that called such a service of the stub would fail with Webots."""
    assert "wheel0_joint/set_torque" in robot.services
    assert "wheel0_joint/set_force" not in robot.services


def test_the_device_list_is_advertised_last(robot):
    """When this service exists, all others exist too, so a client can wait for it."""
    assert list(robot.services)[-1] == "robot/get_device_list"


def test_a_robot_that_is_no_supervisor_has_no_supervisor_services(two_robots):
    """The real controller checks once, at its start, whether the robot is a supervisor."""
    supervisor, robotino = two_robots

    assert any(path.startswith("supervisor/") for path in supervisor.services)
    assert not any(path.startswith("supervisor/") for path in robotino.services)


def test_the_device_list_has_raw_names_and_paths_have_underscores(robot):
    """R2023b returns names with blanks, but names of topics and services cannot have blanks."""
    names = robot.get("robot/get_device_list")

    assert "touch sensor" in names
    assert "touch_sensor/enable" in robot.services
    assert robot.get("robot/get_number_of_devices") == len(names) == 16


def test_devices_are_listed_in_the_order_of_the_world_file(robot):
    """A client may depend on this order."""
    names = robot.get("robot/get_device_list")

    assert names[:4] == ["wheel0_joint", "wheel0_joint_sensor", "wheel1_joint", "wheel1_joint_sensor"]
    assert [name for name in names if name.startswith("ir")] == [f"ir{i}" for i in range(1, 10)]


def test_the_model_name_is_latched_and_global(ros, start):
    """A late subscriber gets one message from each running controller."""
    inbox = ros.topic("/model_name").inboxes
    inbox.append([])
    start()

    (publisher,) = ros.topic("/model_name").publishers
    assert publisher.latched
    assert inbox[0] == [{"data": "robotino"}]


def test_the_robot_tells_about_itself(robot):
    """The trainer's facade reads these values when it connects."""
    assert robot.get("robot/get_basic_time_step") == 32.0
    assert robot.get("robot/get_time") == 0.0
    assert robot.get("robot/get_supervisor") is True
    assert robot.get("robot/get_synchronization") is True
    assert robot.get("robot/get_mode") == 0
    assert robot.get("robot/get_model") == ""
    assert robot.get("robot/get_world_path").endswith("worlds/arena.wbt")


def test_what_the_stub_cannot_do_fails_with_a_remedy(robot):
    """If the call succeeded without an effect, the client would be misled."""
    handle = robot.get("supervisor/get_from_def", name="ROBOTINO")

    with pytest.raises(Exception, match="simulates no forces; use driver mujoco or webots"):
        robot.call("supervisor/node/add_force", node=handle)
    with pytest.raises(Exception, match="no URDF"):
        robot.call("robot/get_urdf", prefix="")


def test_pictures_and_movies_fail_without_rendering(robot):
    """Webots with `--no-rendering` fails in the same way."""
    assert robot.get("supervisor/export_image", filename="/tmp/a.png", quality=50) == 0
    assert robot.get("supervisor/movie_is_ready") == 1
    assert robot.get("supervisor/movie_failed") == 0

    assert robot.get("supervisor/movie_start_recording", filename="/tmp/a.mp4") == 0
    assert robot.get("supervisor/movie_failed") == 1
    assert robot.get("supervisor/movie_stop_recording") is True, "it always is, in the controller"


@pytest.mark.parametrize(
    ("service", "fact"),
    [("world_save", "saves no worlds"), ("animation_start_recording", "records no animations")],
)
def test_a_file_that_no_simulator_writes_fails_with_a_remedy(robot, service, fact):
    """A client would look for a file that does not exist."""
    with pytest.raises(Exception, match=fact):
        robot.call(f"supervisor/{service}", value="/tmp/a.wbt")


def test_the_harmless_rest_answers_as_webots_does(robot):
    """These services act on the window of Webots, which does not exist here, so they only respond."""
    assert robot.get("robot/wait_for_user_input_event", eventType=1, timeout=0) == 0
    assert robot.get("robot/wwi_receive_text") == ""
    assert robot.get("robot/wwi_send_text", value="hello") is True
    assert robot.get("supervisor/get_selected") == 0
    assert robot.get("supervisor/set_label", id=1, label="hello") == 1


def test_remote_control_mode_is_refused(robot):
    """The stub has no real robot to control. A client that wants to pause calls `simulation_set_mode`."""
    assert robot.get("robot/set_mode", arg=b"", mode=0) == 1
    assert robot.get("robot/set_mode", arg=b"", mode=1) == 0
