"""The gateway publishes a robot that is being trained as topics of ROS 2, with a real stub and subscriber."""

import json
import os
import re
import shlex
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import contextmanager
from pathlib import Path

import pytest

from palaestra_protocol.scene import AT_ORIGIN, SceneState, VisibleNode, VisibleScene
from palaestra_sim.ros import Loop, RosNode
from palaestra_trainer.ros import RosSubscriber
from palaestra_trainer.webots.observer import Observer
from tests import ros2
from tests.bench.arena import running
from tests.pages import blocks
from tests.waiting import eventually

HERE = Path(__file__).parent
PAGE = (HERE.parents[2] / "docs/howto/ros2.md").read_text()
MODULE = ("-m", "palaestra_trainer.cli.ros2_gateway")
DEADLINE_S = 30.0
PACE_S = 0.01
A_SECOND = 10.0  # the number of states that a gateway requests per second


class Listener:
    """The subscriber of a gateway's topics, as a program; it keeps the messages of each topic."""

    def __init__(self, namespace):
        words = (HERE / "ros2_listening.py", "--ros-args", "-r", f"__ns:={namespace}")
        self._program = ros2.start(*words, stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self._seen = []
        self._reader = threading.Thread(target=self._read, daemon=True)

    def wait_ready(self):
        """Wait until it has subscribed."""
        assert self._program.stdout.readline() == "ready\n"
        self._reader.start()

    def of(self, topic):
        """Return the messages of a topic, the oldest first."""
        return [message for message in list(self._seen) if message["topic"] == topic]

    def newest(self, topic):
        """Return the last message of a topic; {} before the first."""
        return [{}, *self.of(topic)][-1]

    def close(self):
        """End the program."""
        self._program.stdin.close()
        self._program.wait(DEADLINE_S)
        if self._reader.ident is not None:
            self._reader.join(DEADLINE_S)
        self._program.stdout.close()

    def _read(self):
        for line in self._program.stdout:
            self._seen.append(json.loads(line))


@contextmanager
def shown(log, *arguments, namespace="/", end=signal.SIGINT):
    """Yield a listener of a gateway, which ends with exit code 0."""
    listener = Listener(namespace)
    with log.open("w") as errors:
        options = ("--ros-args", "-r", f"__ns:={namespace}")
        gateway = ros2.start(*MODULE, *arguments, *options, stderr=errors)
    try:
        listener.wait_ready()
        yield listener
        gateway.send_signal(end)
        assert gateway.wait(DEADLINE_S) == 0, log.read_text()
    except AssertionError as error:
        raise AssertionError(log.read_text()) from error
    finally:
        gateway.kill()
        gateway.wait()
        listener.close()


def run_directory(folder, control):
    """Write a run directory with one simulator, whose sidecar has this address."""
    simulator = {"name": "collect-0", "group": "collect", "index": 0, "role": "Collect", "control": control}
    training = {"job": "move", "environment": {"id": "MoveToTargetEnv-v0"}, "steps": 1}
    (folder / "training.yaml").write_text(json.dumps(training | {"simulators": [simulator]}))
    return folder


def refused(*arguments):
    """Return the last line of a gateway that refuses its arguments."""
    done = ros2.start(*MODULE, *arguments, stderr=subprocess.PIPE)
    try:
        _, errors = done.communicate(timeout=DEADLINE_S)
    finally:
        done.kill()
        done.wait()
    assert done.returncode == 2, errors
    return errors.strip().splitlines()[-1]


def words_of(kind):
    """Return the arguments of the program in a block of the page."""
    [command] = blocks(PAGE, f"sh {kind}")
    program, *words = shlex.split(command)
    assert program == "palaestra-ros2"
    return words


class Training:
    """Steps a robot as a training does, and counts the steps."""

    def __init__(self, robot):
        self.robot = robot
        self.observer = Observer("robotino")
        self.begun_s = self.observer.time()
        self.steps = 0

    def step_until(self, seen):
        """Step until `seen` returns a true value."""
        eventually(lambda: self._step() or seen(), pace_s=0.001)

    def _step(self):
        self.robot.drive(0.2, 0.0, 0.3)
        self.robot.advance()
        self.steps += 1


class CountingSimulator:
    """A node with the services and topics of a simulator, which counts the calls of each service."""

    def __init__(self, name, master_uri):
        self.calls = Counter()
        self._loop = Loop()
        self._node = RosNode(self._loop, name, master_uri)
        self._time_s = 0.0
        self._node.serve("robot/get_time", "webots_ros/get_float", self._counted("get_time", self._time))
        self._node.serve("robot/time_step", "webots_ros/set_int", self._counted("time_step", self._done))
        self._node.serve("camera/enable", "webots_ros/set_int", self._counted("enable", self._done))
        self._node.serve("palaestra/scene", "webots_ros/get_string", self._counted("scene", self._scene))
        self._node.serve(
            "palaestra/scene_state", "webots_ros/get_string", self._counted("scene_state", self._state)
        )
        self.camera = self._node.advertise("camera/image", "sensor_msgs/Image")
        self.unread = self._node.advertise("depth_camera/range_image", "sensor_msgs/Image")
        self._thread = threading.Thread(target=self._loop.run, daemon=True)
        self._thread.start()

    def send(self, width, height):
        """Publish an image of both cameras."""
        fields = {"height": height, "width": width, "encoding": "bgra8", "step": 4 * width}
        content = {**fields, "data": bytes(4 * width * height)}
        for publisher in (self.camera, self.unread):
            self._loop.post(lambda publisher=publisher: publisher.send(content))

    def close(self):
        """End the node."""
        self._loop.post(self._node.close)
        self._loop.post(self._loop.stop)
        self._thread.join(DEADLINE_S)
        self._loop.close()

    def _counted(self, name, respond):
        def serve(_request):
            self.calls[name] += 1
            return respond()

        return serve

    def _time(self):
        return {"value": self._time_s}

    def _done(self):
        return {"success": True}

    def _scene(self):
        nodes = (VisibleNode(name="rover", moves=True, robot=True),)
        return {"value": json.dumps(VisibleScene(world="w", revision=1, nodes=nodes).to_json())}

    def _state(self):
        self._time_s += 0.5
        state = SceneState(time_s=self._time_s, revision=1, poses={"rover": AT_ORIGIN})
        return {"value": json.dumps(state.to_json())}


def test_a_robot_of_a_run_is_shown_and_shown_again_after_a_restart(master, tmp_path):
    """The gateway reads the sidecar of the run, and steps nothing."""
    del master
    log = tmp_path / "log"
    with running() as (robot, _, launcher):
        folder = run_directory(tmp_path, launcher.address)
        with shown(log, *words_of("a-run")[1:], folder, namespace="/run") as listener:
            training = Training(robot)
            training.step_until(lambda: listener.of("odom") and listener.of("irsensor_scan"))
            now_s = training.observer.time()

            assert now_s - training.begun_s == pytest.approx(training.steps * robot.period_s)
            for topic in ("/clock", "odom"):
                eventually(lambda topic=topic: is_at(listener.newest(topic), now_s), pace_s=PACE_S)
            pose, odometry = robot.pose(), listener.newest("odom")
            assert odometry["pose"][:2] == pytest.approx((pose.x_m, pose.y_m), abs=1e-4)
            assert odometry["frames"] == ["odom", "base_link"]
            assert not odometry["speed_known"]
            assert len(listener.newest("irsensor_scan")["ranges"]) == 9
            assert {"wheel0_joint", "wheel1_joint"} < listener.newest("joint_states")["positions"].keys()
            times = [message["time_s"] for message in listener.of("/clock")]
            assert times == sorted(times)
            assert "publishes /clock, odom, joint_states and the sensors" in log.read_text()
            assert "tf2_msgs is not installed, so /tf is not published" in log.read_text()

            os.kill(launcher.state().pid, signal.SIGKILL)
            eventually(lambda: "waits for the simulator" in log.read_text(), pace_s=PACE_S)
            launcher.start()
            launcher.confirm_ready()
            eventually(lambda: listener.newest("/clock")["time_s"] < now_s, pace_s=PACE_S)
            training.observer.close()


def test_only_the_scene_is_requested_and_only_topics_that_are_read_are_shown(master, tmp_path):
    """An additional subscriber could make the simulator render pictures, and each request costs time."""
    simulator = CountingSimulator("rover", master)
    reader = RosSubscriber("/rover/camera/image", "sensor_msgs/Image")
    reader.connect()
    words = words_of("a-master")
    assert words == ["--master", "http://localhost:11311", "--robot", "robotino"]
    began_s = time.monotonic()
    try:
        with shown(
            tmp_path / "log",
            *("--master", master, "--robot", "rover"),
            namespace="/master",
            end=signal.SIGTERM,
        ) as listener:
            eventually(lambda: simulator.send(4, 3) or listener.of("camera/image"), pace_s=PACE_S)
            eventually(lambda: len(listener.of("odom")) >= 10, pace_s=PACE_S)
            assert not simulator.unread.heard
        seconds = time.monotonic() - began_s

        assert listener.newest("camera/image") == {
            "topic": "camera/image",
            "size": [4, 3],
            "encoding": "bgra8",
            "bytes": 48,
        }
        assert simulator.calls.keys() == {"scene", "scene_state"}
        assert simulator.calls["scene"] == 1
        assert simulator.calls["scene_state"] <= A_SECOND * seconds + 1
        assert "of robot rover, from node /rover at" in (tmp_path / "log").read_text()
    finally:
        reader.close()
        simulator.close()


def test_a_run_that_does_not_run_is_refused(tmp_path):
    """The folder of a run stays after its end, so the folder alone does not show that the run is running."""
    folder = run_directory(tmp_path, "http://127.0.0.1:1")

    assert f"{folder}: does not run" in refused(folder)


def test_a_robot_without_a_node_is_refused_with_the_nodes_that_exist(master):
    """The ROS names of simulators in a run end with a hash, which a person cannot guess."""
    simulator = CountingSimulator("wanderer", master)
    try:
        assert re.search(
            r"--robot robotino: no robot has a node of this name; use one of .*wanderer",
            refused("--master", master, "--robot", "robotino"),
        )
        assert not simulator.calls
    finally:
        simulator.close()


def test_without_rclpy_the_message_names_the_remedy(tmp_path):
    """Most users have ROS 2, but have not sourced it in this terminal."""
    done = subprocess.run(
        [sys.executable, *MODULE, tmp_path], check=False, capture_output=True, text=True, timeout=DEADLINE_S
    )

    assert done.returncode == 2
    assert "rclpy is not installed; source the setup file of your ROS 2" in done.stderr


def is_at(message, time_s):
    """Return whether a message has this simulated time."""
    return message.get("time_s") == pytest.approx(time_s)
