"""A picture in a message of ROS becomes the image that a policy learned with, or is refused."""

from array import array
from types import SimpleNamespace

import numpy as np
import pytest

from palaestra_trainer.errors import LinkError
from palaestra_trainer.real_robots.ros_images import image_of

SIZE = (64, 48)
RED, BLUE = (250, 10, 20), (5, 15, 240)
ORDERS = {"rgb8": (0, 1, 2), "bgr8": (2, 1, 0), "rgba8": (0, 1, 2, 3), "bgra8": (2, 1, 0, 3)}


def message(encoding="rgb8", size=SIZE, padding=0, **changes):
    """Return an object with the fields of a message; its picture is red on the left and blue on the right."""
    width, height = size
    pixels = np.zeros((height, width, 4), np.uint8)
    pixels[:, : width // 2, :3], pixels[:, width // 2 :, :3] = RED, BLUE
    rows = pixels[:, :, ORDERS.get(encoding, (0,))].reshape(height, -1)
    rows = np.pad(rows, ((0, 0), (0, padding)))
    fields = {"width": width, "height": height, "encoding": encoding, "step": rows.shape[1]}
    return SimpleNamespace(**{**fields, "is_bigendian": 0, "data": rows.tobytes(), **changes})


@pytest.mark.parametrize("encoding", ORDERS)
def test_each_encoding_with_colors_becomes_red_green_and_blue(encoding):
    """Red and blue in the wrong order look like a working camera to a person who reads a log."""
    image = image_of(message(encoding), SIZE)

    assert (image.shape, image.dtype) == ((48, 64, 3), np.uint8)
    assert tuple(image[24, 8]) == RED
    assert tuple(image[24, 56]) == BLUE


def test_a_larger_picture_is_reduced_as_one_of_the_rest_interface():
    """The camera of a real robot has more pixels than that of a simulation."""
    image = image_of(message("bgr8", (640, 480)), SIZE)

    assert image.shape == (48, 64, 3)
    assert tuple(image[0, 31]) == RED
    assert tuple(image[0, 32]) == BLUE


def test_bytes_at_the_end_of_each_row_are_not_pixels():
    """A driver may align rows. If the padding were read as pixels, each row would be shifted."""
    image = image_of(message("rgb8", padding=4), SIZE)

    assert tuple(image[47, 0]) == RED
    assert tuple(image[47, 63]) == BLUE


def test_the_bytes_may_be_an_array_as_rclpy_has_them():
    """In rclpy the data of a message is an array, but in ROS 1 it is bytes."""
    sent = message()
    sent.data = array("B", sent.data)

    assert tuple(image_of(sent, SIZE)[0, 0]) == RED


@pytest.mark.parametrize(
    ("sent", "fact"),
    [
        (
            message("mono8"),
            "the encoding 'mono8' does not have the colors .* one of rgb8, bgr8, rgba8, bgra8",
        ),
        (message("yuv422"), "the encoding 'yuv422'"),
        (message("8UC3"), "the encoding '8UC3'"),
        (message(size=(160, 90)), "another aspect ratio than the policy's 64 x 48; set the camera"),
        (message(width=0), "0 x 48 pixels in rgb8 cannot have 192 bytes a row"),
        (message(height=47), "64 x 47 pixels in rgb8 cannot have 192 bytes a row and 9216 in all"),
        (message(step=191), "64 x 48 pixels in rgb8 cannot have 191 bytes a row"),
        (message(encoding="rgba8", step=192), "in rgba8 cannot have 192 bytes a row"),
        (message(data=b""), "and 0 in all"),
    ],
)
def test_another_picture_is_refused(sent, fact):
    """A guess at colors or rows would show the policy something else than the camera saw."""
    with pytest.raises(LinkError, match=fact):
        image_of(sent, SIZE)
