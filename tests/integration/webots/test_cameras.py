"""Sensors whose readings are arrays, over real sockets."""

import threading

import numpy as np
import pytest

from palaestra_sim.ros import Loop, RosNode
from palaestra_sim.world import builtin
from palaestra_trainer.errors import NoReading, WorldMisfit
from palaestra_trainer.webots import Camera, Lidar, LidarPoints, RangeFinder

BUMPER = b"""TouchSensor {
      translation 0 0 0.153"""
EYES = b"""Camera { name "camera" width 64 height 48 }
    RangeFinder { name "depth camera" width 64 height 48 }
    Lidar { name "lidar" translation 0 0 0.1 numberOfLayers 2 horizontalResolution 5 maxRange 3
      fieldOfView 1.0 verticalFieldOfView 0.1 }
    """


@pytest.fixture
def seer(start, tmp_path):
    """Return a running stub of the arena whose robot has cameras and a lidar."""
    source = builtin("arena").replace(BUMPER, EYES + BUMPER)
    path = tmp_path / "seer.wbt"
    path.write_bytes(source)
    return start(world=path)


def test_a_lidar_measures_in_layers_and_as_points(seer):
    """A point and a range describe the same ray, so the point's distance must equal the range."""
    ranges, points = Lidar("robotino", "lidar"), LidarPoints("robotino", "lidar")
    seer.robot.simulation.add([ranges, points], [])
    seer.robot.connect()

    seer.robot.advance()

    assert (ranges.value.shape, ranges.value.dtype) == ((2, 5), np.float32)
    assert (points.value.shape, points.value.dtype) == ((10, 3), np.float32)
    assert np.linalg.norm(points.value, axis=1) == pytest.approx(ranges.value.ravel(), rel=1e-5)
    assert ranges.value[0, 2] == pytest.approx(2.0, abs=0.01)


def test_a_lidar_sends_a_new_array_every_step(seer):
    """`value` is a view of the newest array, so a program must copy an older one."""
    ranges = Lidar("robotino", "lidar")
    seer.robot.simulation.add([ranges], [])
    seer.robot.connect()
    seer.robot.advance()
    before = ranges.value.copy()

    seer.robot.drive(0.5, 0.0, 0.0)
    for _ in range(3):
        seer.robot.advance()

    assert ranges.value[0, 2] < before[0, 2] - 0.1


@pytest.mark.parametrize("sensor", [Camera("robotino", "camera"), RangeFinder("robotino", "depth camera")])
def test_a_simulator_that_renders_nothing_does_not_fit(seer, sensor):
    """A restart would not help, so the message must name a simulator that renders images."""
    seer.robot.simulation.add([sensor], [])

    with pytest.raises(WorldMisfit, match="a simulator that renders images, such as driver mujoco"):
        seer.robot.connect()


def test_there_is_no_image_before_the_first_step():
    """A policy could not distinguish an empty image from a real one."""
    for read in (lambda: Camera("robotino", "camera").rgb, lambda: RangeFinder("robotino", "depth").depths):
        with pytest.raises(NoReading, match="step the simulation first"):
            read()


SIZES = pytest.mark.parametrize(("height", "width"), [(48, 64), (480, 640), (1080, 1920)])


class Renderer:
    """A ROS node with a camera and a depth camera; a test sends their images."""

    def __init__(self, name, master_uri):
        self.loop = Loop()
        self.node = RosNode(self.loop, name, master_uri)
        for device in ("camera", "depth_camera"):
            self.node.serve(f"{device}/enable", "webots_ros/set_int", lambda _: {"success": True})
        self.camera = self.node.advertise("camera/image", "sensor_msgs/Image")
        self.depth_camera = self.node.advertise("depth_camera/range_image", "sensor_msgs/Image")
        self.thread = threading.Thread(target=self.loop.run, daemon=True)
        self.thread.start()

    def send(self, publisher, pixels, encoding):
        """Publish an image."""
        height, width = pixels.shape[:2]
        fields = {"height": height, "width": width, "encoding": encoding, "step": 4 * width}
        self.loop.post(lambda: publisher.send({**fields, "data": pixels.tobytes()}))

    def end(self):
        """Stop the thread and close the node."""
        self.loop.post(self.node.close)
        self.loop.post(self.loop.stop)
        self.thread.join(60.0)
        self.loop.close()


@pytest.fixture
def renderer(master):
    """Yield a node that publishes the images of the test."""
    made = Renderer("renderer", master)
    yield made
    made.end()


@SIZES
def test_a_camera_reads_each_image_as_it_was_sent(renderer, height, width):
    """Small images arrive at once, and large ones in pieces.

    RGB must contain the same values with reversed channels.
    """
    sent = np.random.default_rng(1).integers(0, 256, (3, height, width, 4), np.uint8)
    camera = Camera("renderer", "camera")
    camera.enable(192)

    for pixels in sent:
        renderer.send(renderer.camera, pixels, "bgra8")

        assert camera.read()
        assert np.array_equal(camera.value, pixels)
        assert np.array_equal(camera.rgb, pixels[..., [2, 1, 0]])
    camera.close()


@SIZES
def test_a_depth_camera_reads_meters(renderer, height, width):
    """The reading is infinite where no object is in range."""
    sent = np.random.default_rng(1).uniform(0.0, 6.0, (height, width)).astype(np.float32)
    sent[0] = np.inf
    depth_camera = RangeFinder("renderer", "depth camera")
    depth_camera.enable(192)

    renderer.send(renderer.depth_camera, sent, "32FC1")

    assert depth_camera.read()
    assert np.array_equal(depth_camera.depths, sent)
    depth_camera.close()
