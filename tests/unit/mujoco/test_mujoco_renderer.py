"""The position, the color and the distance of objects in MuJoCo's images, pixel by pixel."""

import math
import subprocess
import sys
from typing import NamedTuple

import numpy as np
import pytest

from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.mode import Mode
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.scene.validation import LeaveOut
from palaestra_sim.scene.world_report import silent_devices
from palaestra_sim.world import parse

BLUE, GREEN, RED, ALPHA = range(4)
WIDTH, HEIGHT = 64, 48
SKY = (0.2, 0.4, 0.6)
BOX = """DEF BOX Solid { translation 2 0 0.5 children [ DEF SHAPE Shape {
  appearance DEF LOOK PBRAppearance { baseColor 1 0 0 } geometry Box { size 1 1 1 } } ] }"""
WALL = "Solid { translation 2.05 0 0 children [ Shape { geometry Box { size 0.1 9 9 } } ] }"
CAMERA = f'Camera {{ translation 0 0 0.5 name "eye" width {WIDTH} height {HEIGHT} fieldOfView 1 }}'
FINDER = f"""RangeFinder {{ translation 0 0 0.5 name "depth" width {WIDTH} height {HEIGHT}
  fieldOfView 1 minRange 0.5 maxRange 5 }}"""
WHEEL = """HingeJoint { jointParameters HingeJointParameters { axis 0 1 0 anchor 0 %s 0.05 }
  device RotationalMotor { name "%s" maxVelocity 50 }
  endPoint Solid { translation 0 %s 0.05 rotation 1 0 0 1.5707963
    boundingObject Cylinder { radius 0.05 height 0.01 } } }"""


class Request(NamedTuple):
    """A request to the service `save_image`."""

    filename: str
    quality: int = 90


@pytest.fixture
def load():
    """`load(nodes, device)` returns a simulation with a robot at the origin that has this device."""

    def load(nodes, device=CAMERA, parts=""):
        world = f"""#VRML_SIM R2023b utf8
WorldInfo {{ }}
Background {{ skyColor {SKY[0]} {SKY[1]} {SKY[2]} }}
{nodes}
DEF ROBOT Robot {{ name "robot" children [ {device} {parts} ] }}
"""
        return Simulation.load(world.encode(), MujocoPhysics(), "world", Mode.FAST)

    return load


def look(simulation, name="eye"):
    """Return the image of a camera, (height, width, 4)."""
    device = simulation.robots[0].parts.devices.rows[name][1]
    return np.frombuffer(device.value, np.uint8).reshape(HEIGHT, WIDTH, 4)


def depths(simulation):
    """Return the distances that the range finder measures, (height, width)."""
    device = simulation.robots[0].parts.devices.rows["depth"][1]
    return np.frombuffer(device.value, np.float32).reshape(HEIGHT, WIDTH)


def reds(picture):
    """Return the mask of the red pixels of an image, (height, width) of bool."""
    red, others = picture[:, :, RED].astype(int), picture[:, :, [BLUE, GREEN]].astype(int)
    return red > 60 + others.max(axis=2)


def middle(mask):
    """Return the mean column of the pixels of a mask."""
    return np.nonzero(mask)[1].mean()


def test_a_red_box_ahead_is_in_the_middle_before_the_sky(load):
    """The front of the box is 1.5 m away and 1 m wide, and a pixel covers 1 / 58.6 rad."""
    picture = look(load(BOX))

    across = WIDTH / 2.0 / math.tan(0.5) / 1.5
    assert reds(picture)[HEIGHT // 2].sum() == pytest.approx(across, abs=1)
    assert middle(reds(picture)) == pytest.approx((WIDTH - 1) / 2, abs=0.5)
    assert picture[0, 0] == pytest.approx([255 * SKY[2], 255 * SKY[1], 255 * SKY[0], 255], abs=1)


def test_a_color_is_blue_green_red_alpha(load):
    """Programs for Webots expect this order of colors. Alpha is 255 in every pixel."""
    picture = look(load(BOX))
    blue, green, red, _ = picture[HEIGHT // 2, WIDTH // 2]

    assert (blue, green) == (0, 0)
    assert red > 150
    assert (picture[:, :, ALPHA] == 255).all()


def test_left_is_left_and_up_is_up(load):
    """For a camera that looks along x, the y axis points to the left."""
    left = look(load(BOX.replace("2 0 0.5", "2 0.8 1.3")))
    rows, columns = np.nonzero(reds(left))

    assert columns.mean() < WIDTH / 2
    assert rows.mean() < HEIGHT / 2


def test_a_wall_is_as_far_away_as_it_stands_to_the_millimeter(load):
    """Each pixel has the same distance, because distances are measured along the optical axis."""
    seen = depths(load(WALL, FINDER))

    assert seen == pytest.approx(np.full((HEIGHT, WIDTH), 2.0), abs=0.001)


@pytest.mark.parametrize("away_m", [0.45, 5.2])
def test_a_distance_outside_of_the_range_is_infinite(load, away_m):
    """The wall is nearer than `minRange` or beyond `maxRange`."""
    seen = depths(load(WALL.replace("2.05", str(away_m + 0.05)), FINDER))

    assert np.isinf(seen).all()


def test_distances_have_the_resolution_of_the_finder(load):
    """A policy must not get more precise distances than the range finder measures.

    Each distance is a multiple of the field `resolution`.
    """
    seen = depths(load(WALL, FINDER.replace("minRange", "resolution 0.3 minRange")))

    assert seen == pytest.approx(np.full((HEIGHT, WIDTH), 2.1), abs=1e-6)


def test_a_thing_that_a_supervisor_moves_moves_in_the_picture(load):
    """The box has no boundingObject, and still moves in the next image. A reset moves it back."""
    simulation = load(BOX)
    before = middle(reds(look(simulation)))

    simulation.changed(_with(simulation, "BOX", translation=(2.0, -0.5, 0.5)), "translation")
    after = middle(reds(look(simulation)))
    simulation.reset()
    simulation.step(32)

    assert after > before + 5
    assert middle(reds(look(simulation))) == before


def test_a_color_that_a_supervisor_writes_is_seen(load):
    """Domain randomization changes the colors of objects during a training."""
    simulation = load(BOX)

    assert reds(look(simulation)).any()
    simulation.changed(_with(simulation, "LOOK", baseColor=(0.0, 1.0, 0.0)), "baseColor")

    assert not reds(look(simulation)).any()


def test_a_thing_that_a_supervisor_removes_is_gone(load):
    """The next image must not show the removed object."""
    simulation = load(BOX)

    assert reds(look(simulation)).any()
    simulation.remove(simulation.tree.of_def("BOX"))

    assert not reds(look(simulation)).any()


def test_a_camera_turns_with_its_robot(load):
    """If the robot turns to the left, objects move to the right in the image."""
    simulation = load(BOX, parts=WHEEL % ("0.1", "left", "0.1") + WHEEL % ("-0.1", "right", "-0.1"))
    before = middle(reds(look(simulation)))
    motors = simulation.robots[0].motors
    for name, speed in (("left", -1.0), ("right", 1.0)):
        motors[name].set_position(math.inf)
        motors[name].set_velocity(speed)
    simulation.step(320)

    heading = simulation.robots[0].body.heading_rad
    across = WIDTH / 2.0 / math.tan(0.5)
    assert heading > 0.05
    assert middle(reds(look(simulation))) == pytest.approx(before + across * math.tan(heading), abs=1.5)


def test_a_shape_on_a_joint_moves_with_its_motor(load):
    """A camera that looks at a robot's arm must show the arm's motion."""
    arm = """SliderJoint { jointParameters JointParameters { axis 0 1 0 }
      device LinearMotor { name "arm" maxVelocity 10 }
      endPoint Solid { translation 2 0 0.5 children [ Shape {
        appearance PBRAppearance { baseColor 1 0 0 } geometry Box { size 0.2 0.2 0.2 } } ] } }"""
    simulation = load("", parts=arm)
    before = middle(reds(look(simulation)))
    simulation.robots[0].motors["arm"].set_position(0.5)
    for _ in range(10):
        simulation.step(32)

    assert middle(reds(look(simulation))) < before - 5


@pytest.mark.parametrize(
    "geometry",
    [
        "Sphere { radius 0.4 }",
        "Cylinder { radius 0.4 height 0.8 }",
        "Capsule { radius 0.2 height 0.4 }",
        "Cone { bottomRadius 0.4 height 0.8 }",
        """IndexedFaceSet { coord Coordinate { point [ 0 -0.4 -0.4, 0 0.4 -0.4, 0 0.4 0.4, 0 -0.4 0.4 ] }
           coordIndex [ 3 2 1 0 -1 ] }""",
    ],
)
def test_every_geometry_is_drawn_where_it_is(load, geometry):
    """MuJoCo moves the origin of a mesh to its center, so the renderer must move it back."""
    picture = look(load(BOX.replace("Box { size 1 1 1 }", geometry)))
    rows, columns = np.nonzero(reds(picture))

    assert len(rows) > 100
    assert columns.mean() == pytest.approx((WIDTH - 1) / 2, abs=0.6)
    assert (rows.min() + rows.max()) / 2 == pytest.approx((HEIGHT - 1) / 2, abs=2.5)


def test_a_spherical_camera_sees_nothing(load):
    """The renderer makes only flat images, so the camera sends none, as in a simulator without a renderer."""
    simulation = load(BOX, CAMERA.replace("fieldOfView", "spherical TRUE fieldOfView"))
    kind, camera = simulation.robots[0].parts.devices.rows["eye"]

    assert kind.silent(camera)
    assert camera.value == b""


RECOGNITION = CAMERA.replace("fieldOfView", "recognition Recognition { segmentation TRUE } fieldOfView")
OBJECT = BOX.replace("DEF BOX Solid {", 'DEF BOX Solid { recognitionColors [ 0 1 0, 1 0 1 ] model "crate"')


def recognized(simulation):
    """Return the messages of the recognized objects."""
    return simulation.robots[0].parts.devices.rows["eye"][1].recognition.value


def test_a_solid_with_recognition_colors_is_recognized(load):
    """The message has the object's position, its size in the image and its colors."""
    (found,) = recognized(load(OBJECT, RECOGNITION))

    assert found["position"] == pytest.approx((2.0, 0.0, 0.0))
    assert found["orientation"] == pytest.approx((0.0, 0.0, 0.0, 1.0))
    assert found["position_on_image"] == pytest.approx((WIDTH / 2, HEIGHT / 2, 0.0), abs=1)
    assert found["size_on_image"] == pytest.approx((39.0, 39.0, 0.0), abs=1)
    assert (found["number_of_colors"], found["colors"]) == (2, [(0.0, 1.0, 0.0), (1.0, 0.0, 1.0)])
    assert found["model"] == "crate"


def test_what_is_behind_a_wall_is_not_recognized(load):
    """Objects without colors, out of range or above `maxObjects` are not recognized either."""
    wall = WALL.replace("2.05", "1")
    near = RECOGNITION.replace("segmentation TRUE", "maxRange 1")
    none = RECOGNITION.replace("segmentation TRUE", "maxObjects 0")

    assert recognized(load(f"{OBJECT} {wall}", RECOGNITION)) == []
    assert recognized(load(BOX, RECOGNITION)) == []
    assert recognized(load(OBJECT, near)) == []
    assert recognized(load(OBJECT, none)) == []


def test_the_image_of_segments_has_plain_colors(load):
    """An object has its first recognition color, and the rest of the image is black."""
    simulation = load(OBJECT, RECOGNITION)
    recognition = simulation.robots[0].parts.devices.rows["eye"][1].recognition
    picture = np.frombuffer(recognition.picture, np.uint8).reshape(HEIGHT, WIDTH, 4)

    assert picture[HEIGHT // 2, WIDTH // 2].tolist() == [0, 255, 0, 255]
    assert picture[0, 0].tolist() == [0, 0, 0, 255]


def test_the_view_of_the_world_is_saved_as_a_file(load, tmp_path):
    """The Viewpoint of the world determines the image, not a robot's camera."""
    simulation = load(f"Viewpoint {{ position 0 0 0.5 }} {BOX}")

    assert simulation.export_image(str(tmp_path / "world.png"), 100)
    assert (tmp_path / "world.png").read_bytes()[:4] == b"\x89PNG"


def test_a_camera_and_a_range_finder_save_what_they_see(load, tmp_path):
    """A range finder saves its distances as shades of gray."""
    simulation = load(WALL, CAMERA + FINDER)

    for name in ("eye", "depth"):
        kind, device = simulation.robots[0].parts.devices.rows[name]
        services = {path: handler for path, _, handler in kind.services(device)}
        answer = services["save_image"](Request(filename=str(tmp_path / f"{name}.png")))

        assert answer == {"success": 1}
        assert (tmp_path / f"{name}.png").read_bytes()[:4] == b"\x89PNG"


HASH = """import hashlib
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.camera_interface import Lens
from palaestra_sim.scene.frames import Frame
from palaestra_sim.scene.simulation import Simulation
from palaestra_sim.world import builtin
physics = MujocoPhysics()
Simulation.load(builtin("arena"), physics)
frame = Frame(None, (-1.5, -1.5, 0.5), (0.0, 0.0, 1.0, 0.8))
eye = physics.eye(frame, Lens(size=(160, 120), field_of_view_rad=1.2, near_m=0.01))
print(hashlib.sha256(eye.colors()).hexdigest(), hashlib.sha256(eye.depths(0.0, 0.0)).hexdigest())
"""


def test_two_processes_draw_the_same_bytes():
    """The images are equal on one machine.

    Another version of Mesa or a graphics card may round differently.
    """
    found = {
        subprocess.run([sys.executable, "-c", HASH], capture_output=True, check=True).stdout for _ in "ab"
    }

    assert len(found) == 1


BLIND = """import os, sys
os.environ.update(%r)
from palaestra_sim.errors import SimError
from palaestra_sim.mujoco.physics import MujocoPhysics
from palaestra_sim.scene.simulation import Simulation
world = b"#VRML_SIM R2023b utf8\\nRobot { children [ Camera { } ] }\\n"
simulation = Simulation.load(world, MujocoPhysics())
simulation.step(32)
try:
    simulation.robots[0].parts.devices.rows["camera"][1].enabled(32)
except SimError as error:
    print(error)
"""


@pytest.mark.parametrize(
    ("environment", "message"),
    [
        ({"PYOPENGL_PLATFORM": "glx"}, "install the Debian packages libegl1 libgl1-mesa-dri libopengl0"),
        ({"MUJOCO_GL": "glfw"}, "MUJOCO_GL=glfw cannot draw pictures; use egl or osmesa"),
    ],
)
def test_a_machine_that_cannot_draw_simulates_the_rest(environment, message):
    """OpenGL is loaded only for the first camera. The error then names the missing packages."""
    done = subprocess.run(
        [sys.executable, "-c", BLIND % environment], capture_output=True, text=True, check=True
    )

    assert message in done.stdout


def test_a_camera_that_sees_is_not_counted_among_the_silent_devices(load):
    """The warning at the start lists only devices that will never send a value to a waiting client."""
    simulation = load(
        "",
        f"{CAMERA} {FINDER}",
        'Camera { name "ball" spherical TRUE }] controller "ros" controllerArgs [ "--name=r" "--synchronize"',
    )

    assert silent_devices(simulation.robots) == "1 Camera"


def test_a_loose_thing_is_seen_where_it_has_fallen(load):
    """Here the physics moves the object, not a client."""
    simulation = load(
        BOX.replace("children [", "physics Physics { } boundingObject Box { size 1 1 1 } children [").replace(
            "2 0 0.5", "3 0 1.5"
        )
    )
    before = np.nonzero(reds(look(simulation)))[0].mean()
    for _ in range(40):
        simulation.step(32)

    assert np.nonzero(reds(look(simulation)))[0].mean() > before + 5


OLD = """#VRML_SIM R2021b utf8
WorldInfo { coordinateSystem "NUE" }
Solid { translation 0 0.5 -2 children [ Shape {
  appearance PBRAppearance { baseColor 1 0 0 } geometry Box { size 1 1 1 } } ] }
Robot { name "robot" children [ %s ] }
"""


def test_a_camera_of_an_old_file_looks_along_minus_z_with_y_up():
    """World files from before Webots R2022a use these axes."""
    leave_out = LeaveOut(types=frozenset(("WorldInfo",)))
    camera = CAMERA.replace("0 0 0.5", "0 0.5 0")
    world = parse((OLD % camera).encode(), "world")
    simulation = Simulation.of(world, MujocoPhysics(), leave_out=leave_out)
    rows, columns = np.nonzero(reds(look(simulation)))

    assert columns.mean() == pytest.approx((WIDTH - 1) / 2, abs=0.5)
    assert rows.mean() == pytest.approx((HEIGHT - 1) / 2, abs=0.5)


def _with(simulation, name, **fields):
    """Return a node after some of its fields got other numbers."""
    node = simulation.tree.of_def(name)
    for field, numbers in fields.items():
        node.fields[field].items[:] = list(numbers)
    return node
