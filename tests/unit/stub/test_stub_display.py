"""Display: a program draws on it, and copies and pastes parts of its picture."""

import pytest

from palaestra_sim.ros.node import ServiceFailed
from palaestra_sim.scene import image_buffer
from palaestra_sim.scene.image_buffer import ImageBuffer

RED = (0, 0, 255, 255)
ROBOT = """Robot { supervisor TRUE controller "ros" controllerArgs [ "--name=painter" "--synchronize" ]
  children [ Display { name "screen" width 8 height 6 } ] }"""


@pytest.fixture
def painter(start, world, ros):
    """Return the node of a robot with a display, and the display's image buffer."""
    simulation = start(world(robot=ROBOT)).simulation
    return ros.node("painter"), simulation.robots[0].parts.devices.rows["screen"][1].picture


def lit(picture):
    """Return the rows of an image as text, with # for each pixel that is not black."""
    return [
        "".join("#" if any(picture.at(x, y)[:3]) else "." for x in range(picture.width))
        for y in range(picture.height)
    ]


@pytest.mark.parametrize(
    ("points", "rows"),
    [
        (image_buffer.line(0, 0, 4, 2), ["##...", "..#..", "...##", ".....", "....."]),
        (image_buffer.rectangle(1, 1, 3, 3), [".....", ".###.", ".#.#.", ".###.", "....."]),
        (image_buffer.filled_rectangle(3, 3, 5, 5), [".....", ".....", ".....", "...##", "...##"]),
        (image_buffer.oval(2, 2, 2, 2), [".###.", "##.##", "#...#", "##.##", ".###."]),
        (image_buffer.filled_oval(2, 2, 2, 1), [".....", "..#..", "#####", "..#..", "....."]),
        (image_buffer.outline([(0, 0), (4, 0), (0, 4)]), ["#####", "#..#.", "#.#..", "##...", "#...."]),
        (
            image_buffer.filled_polygon([(0, 0), (4, 0), (0, 4)]),
            ["#####", "####.", "###..", "##...", "#...."],
        ),
    ],
    ids=["line", "rectangle", "filled rectangle", "oval", "filled oval", "polygon", "filled polygon"],
)
def test_a_shape_is_drawn_as_far_as_it_is_on_the_picture(points, rows):
    """A program may draw beyond the edge of the image. The call must neither fail nor change other pixels."""
    picture = ImageBuffer(width=5, height=5)
    picture.draw(points, RED)

    assert lit(picture) == rows


def test_every_drawing_service_draws(painter):
    """Each service uses the color, alpha and opacity that were set last."""
    robot, picture = painter
    assert robot.get("screen/set_color", value=0xFF8000) is True
    assert robot.get("screen/draw_pixel", x1=1, y1=2) == 1
    assert picture.at(1, 2) == (0, 128, 255, 255)
    robot.call("screen/set_alpha", value=0.5)
    robot.call("screen/set_opacity", value=0.5)
    robot.call("screen/set_color", value=0)
    robot.call("screen/draw_pixel", x1=1, y1=2)
    assert picture.at(1, 2) == (0, 64, 128, 191)

    robot.call("screen/set_alpha", value=1.0)
    robot.call("screen/set_opacity", value=1.0)
    robot.call("screen/set_color", value=0xFFFFFF)
    square = {"x": [0, 2, 2, 0], "y": [3, 3, 5, 5], "size": 4}
    assert robot.get("screen/draw_line", x1=0, y1=0, x2=7, y2=0) == 1
    assert robot.get("screen/draw_rectangle", x=5, y=1, width=3, height=5) == 1
    assert robot.get("screen/fill_polygon", **square) == 1
    assert robot.get("screen/draw_polygon", **square) == 1
    assert lit(picture) == ["########", ".....###", ".#...#.#", "###..#.#", "###..#.#", "###..###"]


def test_what_was_copied_can_be_pasted(painter):
    """A handle is valid until the client deletes it; Webots would crash at a later use."""
    robot, picture = painter
    robot.call("screen/fill_rectangle", x=0, y=0, width=2, height=2)
    image = robot.get("screen/image_copy", x=1, y=1, width=2, height=2)
    assert robot.get("screen/image_paste", ir=image, x=6, y=4, blend=1) == 1
    assert lit(picture)[4:] == ["......#.", "........"]

    assert robot.get("screen/image_delete", ir=image) == 1
    with pytest.raises(
        ServiceFailed, match=f"the image {image} does not exist; make one with image_new or image_copy"
    ):
        robot.call("screen/image_paste", ir=image, x=0, y=0, blend=1)


@pytest.mark.parametrize(
    ("format_", "pixel"),
    [
        (3, [255, 128, 0]),
        (4, [255, 128, 0, 255]),
        (5, [255, 255, 128, 0]),
        (6, [0, 128, 255, 255]),
        (7, [255, 0, 128, 255]),
    ],
    ids=["RGB", "RGBA", "ARGB", "BGRA", "ABGR"],
)
def test_an_image_comes_in_any_format(painter, format_, pixel):
    """The pixel is orange in each of these formats."""
    robot, picture = painter
    image = robot.get("screen/image_new", width=1, height=1, data=pixel, format=format_)
    robot.call("screen/image_paste", ir=image, x=0, y=0, blend=0)

    assert picture.at(0, 0) == (0, 128, 255, 255)


def test_bytes_that_an_image_lacks_are_black(painter):
    """The complete client of webots_ros sends 5 bytes for 50 pixels.

    Webots reads beyond the end of the data.
    """
    robot, picture = painter
    image = robot.get("screen/image_new", width=2, height=1, data=[255, 128], format=3)
    robot.call("screen/image_paste", ir=image, x=0, y=0, blend=0)

    assert [picture.at(0, 0), picture.at(1, 0)] == [(0, 128, 255, 255), (0, 0, 0, 255)]


@pytest.mark.parametrize(
    ("service", "request_"),
    [
        ("image_new", {"width": 1, "height": 1, "data": [0], "format": 9}),
        ("image_new", {"width": 0, "height": 1, "data": [0], "format": 3}),
        ("image_copy", {"x": 0, "y": 0, "width": 2, "height": 0}),
        ("image_load", {"filename": "logo.png"}),
    ],
)
def test_an_image_that_cannot_be_made_has_the_handle_0(painter, service, request_):
    """Calls with handle 0 succeed without an effect; Webots only prints that the handle is invalid."""
    robot, picture = painter
    image = robot.get(f"screen/{service}", **request_)

    assert image == 0
    assert robot.get("screen/image_paste", ir=image, x=0, y=0, blend=0) == 1
    assert robot.get("screen/image_delete", ir=image) == 1
    assert not any("#" in row for row in lit(picture))


@pytest.mark.parametrize(
    ("service", "request_", "fact"),
    [
        (
            "image_new",
            {"width": 5000, "height": 1, "data": [0], "format": 3},
            "width has a number above 4096",
        ),
        ("fill_oval", {"cx": 0, "cy": 0, "a": 1 << 30, "b": 1}, "a has a number above 4096"),
        ("draw_polygon", {"x": [0, 5000], "y": [0, 0], "size": 2}, "x has a number above 4096"),
    ],
)
def test_what_cannot_be_drawn_is_refused(painter, service, request_, fact):
    """A client must not see half a drawing, and a huge shape must not occupy the simulator."""
    robot, picture = painter
    with pytest.raises(ServiceFailed, match=fact):
        robot.call(f"screen/{service}", **request_)

    assert not any("#" in row for row in lit(picture))


def test_a_picture_is_mixed_with_what_is_there_only_if_it_blends(painter):
    """With blending, alpha mixes the pasted pixels with the old ones.

    Without blending, the pasted pixels replace them.
    """
    robot, picture = painter
    robot.call("screen/fill_rectangle", x=0, y=0, width=8, height=6)
    image = robot.get("screen/image_new", width=1, height=1, data=[0, 0, 0, 51], format=6)
    robot.call("screen/image_paste", ir=image, x=0, y=0, blend=1)
    robot.call("screen/image_paste", ir=image, x=1, y=0, blend=0)

    assert [picture.at(0, 0), picture.at(1, 0)] == [(204, 204, 204, 255), (0, 0, 0, 51)]


def test_a_copy_ends_at_the_edge_of_the_display(painter):
    """A copy contains no pixels from beyond the edge, so a paste changes nothing in their place."""
    robot, picture = painter
    robot.call("screen/draw_pixel", x1=7, y1=5)
    image = robot.get("screen/image_copy", x=7, y=5, width=4, height=4)
    nothing = robot.get("screen/image_copy", x=9, y=9, width=4, height=4)
    robot.call("screen/image_paste", ir=image, x=0, y=0, blend=0)
    robot.call("screen/image_paste", ir=nothing, x=2, y=2, blend=0)

    assert lit(picture) == ["#.......", *["........"] * 4, ".......#"]


def test_an_image_is_saved_and_loaded(painter, tmp_path):
    """Handle 0 stands for the display itself, which is black at first."""
    robot, picture = painter
    path = str(tmp_path / "screen.png")
    robot.call("screen/draw_pixel", x1=0, y1=0)
    assert robot.get("screen/image_save", filename=path, ir=0) == 1
    robot.call("screen/fill_rectangle", x=0, y=0, width=8, height=6)

    image = robot.get("screen/image_load", filename=path)
    robot.call("screen/image_paste", ir=image, x=0, y=0, blend=0)

    assert lit(picture) == ["#.......", *["........"] * 5]
    assert picture.at(7, 5) == (0, 0, 0, 255)
    assert robot.get("screen/image_save", filename=str(tmp_path / "none" / "a.png"), ir=image) == 0


def test_a_text_is_drawn_in_the_size_of_the_font(painter):
    """Lines of text are drawn one below the other; without smoothing, edges have no gray pixels.

    A font size below 1 changes nothing.
    """
    robot, picture = painter
    assert robot.get("screen/set_font", font="Arial", size=6, antiAliasing=0) == 1
    assert robot.get("screen/set_font", font="Arial", size=0, antiAliasing=1) == 1
    assert robot.get("screen/draw_text", text="I\nI", x=0, y=-1) == 1

    rows = lit(picture)
    assert any("#" in row for row in rows)
    assert {picture.at(x, y) for x in range(8) for y in range(6)} == {(0, 0, 0, 255), (255,) * 4}


def test_only_a_camera_that_sees_is_attached(start, world, ros):
    """The camera here has no images, so an attached display would show nothing."""
    start(world(robot=ROBOT.replace("children [", 'children [ Camera { name "eye" } LED { name "lamp" }')))
    robot = ros.node("painter")

    assert tuple(robot.call("screen/get_info")) == (8, 6)
    assert robot.get("screen/attach_camera", value="nose") is False
    with pytest.raises(ServiceFailed, match="lamp is not a Camera"):
        robot.call("screen/attach_camera", value="lamp")
    with pytest.raises(ServiceFailed, match="eye has no image in this simulator"):
        robot.call("screen/attach_camera", value="eye")
    assert robot.get("screen/detach_camera") is True
