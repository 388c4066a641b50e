"""A cart-pole in MJCF runs in `palaestra-mujoco` and is driven over ROS like a Webots robot."""

from pathlib import Path

import pytest
import yaml

from palaestra_trainer.ros import RosService
from palaestra_trainer.webots import JointMotor, Mode, MujocoActuator, MujocoSensor, Webots
from palaestra_trainer.webots.devices import PositionSensor
from palaestra_trainer.webots.launching.local_simulator import ProcessLauncher

STEP_MS = 40
EXAMPLE = Path(__file__).parents[3] / "manifests/examples/cartpole-mjcf.yaml"


class CartPole:
    """A running simulator, and the services of its robot."""

    def __init__(self, world):
        self.launcher = ProcessLauncher(world, driver="mujoco")
        self.webots = Webots("cartpole", world, launcher=self.launcher, start_deadline_s=30.0)
        self.webots.start()
        self.webots.supervisor.set_mode(Mode.FAST)
        self.position = PositionSensor("cartpole", "cart position")
        self.position.enable(STEP_MS)
        self._services = []

    def call(self, path, type_name, **request):
        """Call a service, and return the response."""
        service = RosService(f"/cartpole/{path}", f"webots_ros/{type_name}")
        self._services.append(service)
        return service(**request)

    def step(self):
        """Take one step, and return the cart's position."""
        assert self.call("robot/time_step", "set_int", value=STEP_MS).success
        assert self.position.read()
        return self.position.value

    def node(self, name):
        """Return the handle of a node."""
        return self.call("supervisor/get_from_def", "supervisor_get_from_def", name=name).node

    def close(self):
        """End the simulator and its sidecar."""
        for each in (*self._services, self.position):
            each.close()
        self.webots.stop()
        self.webots.close()
        self.launcher.close()


@pytest.fixture
def source():
    """Return the world of the example."""
    job = yaml.safe_load(EXAMPLE.read_text())
    return job["spec"]["simulators"][0]["world"]["inline"]


@pytest.fixture
def cartpole(master, tmp_path, source):
    """Yield the running example; its robot has the name `cartpole`."""
    del master
    world = tmp_path / "cartpole.xml"
    world.write_text(source)
    running = CartPole(world)
    yield running
    running.close()


def test_a_model_of_mujoco_is_driven_measured_moved_and_reset_over_ros(cartpole):
    """A user drives an MJCF model with the same services and facades as a robot of Webots."""
    devices = cartpole.call("robot/get_device_list", "robot_get_device_list", ask=True).list
    assert list(devices) == ["push", "cart position", "cart speed", "pole angle", "pole speed"]
    start = cartpole.step()

    assert cartpole.call("push/set_force", "set_float", value=5.0).success
    pushed = [cartpole.step() for _ in range(5)]
    place = cartpole.call("supervisor/node/get_position", "node_get_position", node=cartpole.node("cart"))
    cartpole.call("supervisor/simulation_reset", "get_bool", ask=True)
    again = cartpole.step()
    cartpole.call("push/set_force", "set_float", value=5.0)

    assert start == again == 0.0
    assert pushed[-1] > 0.05
    assert place.position.x == pushed[-1]
    assert [cartpole.step() for _ in range(5)] == pushed

    tilted = {"node": cartpole.node("hinge"), "position": 0.2, "index": 1}
    assert cartpole.call("supervisor/node/set_joint_position", "node_set_joint_position", **tilted).success
    velocity = cartpole.call("supervisor/node/get_velocity", "node_get_velocity", node=cartpole.node("pole"))
    assert velocity.velocity.linear.x > 0.1


class TestAKeyframe:
    """A world whose keyframe contains a control that pushes the cart."""

    @pytest.fixture
    def source(self, source):
        """Return the world of the example with such a keyframe."""
        named = source.replace("<custom>", '<custom><text name="keyframe" data="home"/>')
        return named.replace("</mujoco>", '<keyframe><key name="home" ctrl="5"/></keyframe></mujoco>')

    def test_its_control_acts_until_the_first_command_after_a_reset(self, cartpole):
        """If a reset set the control to 0, a robot that its keyframe keeps upright would fall."""
        lever = JointMotor("cartpole", "push", "force")
        lever.release()
        start = [cartpole.step() for _ in range(5)]
        cartpole.call("supervisor/simulation_reset", "get_bool", ask=True)
        cartpole.step()
        lever.release()
        again = [cartpole.step() for _ in range(5)]
        lever.set(-100.0)
        back = [cartpole.step() for _ in range(5)]
        lever.close()

        assert start[-1] > 0.05
        assert again[-1] > 0.05
        assert back[-1] - back[-2] < back[1] - back[0]


class TestWhatWebotsDoesNotHave:
    """A world with a sensor and an actuator for which Webots has no device."""

    @pytest.fixture
    def source(self, source):
        """Return the world of the example with this sensor and this actuator."""
        sensor = '<subtreecom name="center of mass" body="cart"/></sensor>'
        return source.replace(
            "</actuator>", '<adhesion name="grip" body="cart" ctrlrange="0 1"/></actuator>'
        ).replace("</sensor>", sensor)

    def test_facades_read_its_numbers_and_set_its_control(self, cartpole):
        """Their services are below `mujoco/` and have the names in the model."""
        sensor = MujocoSensor("cartpole", "center of mass")
        sensor.enable(STEP_MS)
        grip = MujocoActuator("cartpole", "grip")
        grip.set(2.0)
        cartpole.step()

        assert sensor.read()
        assert sensor.value.shape == (3,)
        assert cartpole.call("mujoco/grip/get_control", "get_float", ask=True).value == 1.0
        sensor.disable()
        grip.close()
