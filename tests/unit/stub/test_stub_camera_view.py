"""The newest image of a robot's camera, for viewers."""

import json

import pytest

from palaestra_protocol.camera_picture import MOST_SIDE, CameraPicture
from palaestra_protocol.control import VIEW_CAMERA
from palaestra_sim.ros_controller.simulator import RunningSimulator
from palaestra_sim.ros_controller.viewing import answers
from palaestra_sim.scene.loader import Loader
from palaestra_sim.scene.mode import Mode
from palaestra_sim.stub.physics import StubPhysics


class Eye:
    """A camera whose pixels have their column as blue and the number of the image as red."""

    def __init__(self, lens):
        self.lens = lens
        self.pictures = 0

    def open(self):
        """Do nothing, because this camera needs no renderer."""

    def colors(self):
        """Return the next image."""
        self.pictures += 1
        width, height = self.lens.size
        return b"".join(bytes((x % 256, 7, self.pictures, 255)) for x in range(width)) * height


@pytest.fixture
def eyes():
    """Return a list that collects the cameras."""
    return []


@pytest.fixture
def see(ros, tmp_path, world, simple_robot, eyes):
    """`see(width, height)` starts a simulator with such a camera.

    It returns the robot's node and a function that requests an image, as a viewer does.
    """

    class Seeing(StubPhysics):
        def eye(self, place, lens):
            del place
            eyes.append(Eye(lens))
            return eyes[-1]

    def started(width, height):
        camera = f'children [ Camera {{ name "eye" width {width} height {height} }}'
        path = tmp_path / "seeing.wbt"
        path.write_bytes(world(robot=simple_robot.replace("children [", camera, 1)))
        simulator = RunningSimulator(path, Loader(physics=Seeing), ros.make_node, mode=Mode.FAST)
        simulator.start()
        request = answers(simulator)[VIEW_CAMERA]
        return ros.node("robotino"), lambda: json.loads(request())

    return started


def test_a_viewer_gets_the_picture_that_the_trainer_got_last(see, eyes):
    """The viewer sees the image on which the policy acted, and no image is rendered for the viewer."""
    robot, look = see(4, 2)
    robot.call("eye/enable", value=32)
    robot.inbox("eye/image")
    for _ in range(2):
        robot.call("robot/time_step", value=32)

    pictures = [CameraPicture.from_json(look()) for _ in range(3)]

    assert pictures == [CameraPicture(name="eye", width=4, height=2, pixels=pictures[0].pixels)] * 3
    assert pictures[0].pixels == b"".join(bytes((2, 7, x)) for x in range(4)) * 2
    assert eyes[0].pictures == 2


def test_a_camera_that_nobody_reads_has_no_picture(see, eyes):
    """Rendering takes longer than the rest of a step, so a training that reads no images renders none."""
    robot, look = see(4, 2)
    robot.call("robot/time_step", value=32)

    assert look() is None
    assert eyes[0].pictures == 0


def test_a_camera_that_is_off_has_no_picture(see):
    """An old image would look as if the robot stood still."""
    robot, look = see(4, 2)
    robot.call("eye/enable", value=32)
    robot.inbox("eye/image")
    robot.call("robot/time_step", value=32)

    robot.call("eye/enable", value=0)

    assert look() is None


def test_a_large_picture_loses_columns_and_rows(see):
    """A web page needs no larger image, and the size of a response is limited."""
    robot, look = see(2 * MOST_SIDE, 10)
    robot.call("eye/enable", value=32)
    robot.inbox("eye/image")
    robot.call("robot/time_step", value=32)

    picture = CameraPicture.from_json(look())

    assert (picture.width, picture.height) == (MOST_SIDE, 5)
    assert picture.pixels[:9] == bytes((1, 7, 0, 1, 7, 2, 1, 7, 4))
