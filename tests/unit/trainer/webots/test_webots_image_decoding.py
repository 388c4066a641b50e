"""Decoding messages of cameras and lidars into arrays, and rejecting damaged ones."""

import math
import struct

import numpy as np
import pytest

from palaestra_protocol.ros.rostypes import message_type
from palaestra_trainer.webots.image_decoding import ImageReading, PointsReading, RangesReading

PIXELS = np.arange(2 * 3 * 4, dtype=np.uint8).reshape(2, 3, 4)
METERS = np.array([[0.5, 1.0, math.inf], [0.0, 2.5, 3.0]], np.float32)
POINTS = np.array([[1.0, 2.0, 3.0], [math.inf, math.inf, math.inf]], np.float32)


def image(data, kind, pixel_bytes, frame_id="robotino/camera", **changes):
    """Return an array as the bytes of a sensor_msgs/Image; `changes` replaces fields of the message."""
    height, width = data.shape[:2]
    fields = {
        "header": {"seq": 3, "frame_id": frame_id},
        "height": height,
        "width": width,
        "encoding": kind,
        "step": width * pixel_bytes,
        "data": data.tobytes(),
    }
    return memoryview(message_type("sensor_msgs/Image").codec.encode(fields | changes))


def color(**changes):
    """Return a message of a color camera."""
    return image(PIXELS, "bgra8", 4, **changes)


def depth(data=METERS, **changes):
    """Return a message of a depth camera."""
    return image(data, "32FC1", 4, **changes)


def cloud(names=("x", "y", "z", "layer", "time"), **changes):
    """Return a message with a lidar's point cloud, packed as by the `ros` controller."""
    packed = b"".join(struct.pack("<fffif", *point, 0, 0.0) for point in POINTS)
    fields = {
        "header": {"frame_id": "robotino/lidar"},
        "height": 1,
        "width": len(POINTS),
        "fields": [
            {"name": name, "offset": 4 * number, "datatype": 5 if name == "layer" else 7, "count": 1}
            for number, name in enumerate(names)
        ],
        "point_step": 20,
        "row_step": len(packed),
        "data": packed,
    }
    return memoryview(message_type("sensor_msgs/PointCloud2").codec.encode(fields | changes))


KINDS = {
    "color": (lambda: ImageReading("camera"), color, PIXELS),
    "depth": (lambda: RangesReading("depth camera"), depth, METERS),
    "points": (lambda: PointsReading("lidar"), cloud, POINTS),
}


@pytest.fixture(params=KINDS)
def kind(request):
    """Return a reader for the messages of a device, a function that makes a message, and its array."""
    make_reading, make_message, array = KINDS[request.param]
    return make_reading(), make_message, array


def test_the_array_has_shape_and_type_of_the_sensor(kind):
    """The first message is parsed completely; later messages reuse its layout."""
    read, make_message, array = kind

    for _ in range(2):
        seen = read(make_message())

        assert (seen.shape, seen.dtype) == (array.shape, array.dtype)
        assert np.array_equal(seen, array)


def test_no_pixel_is_copied(kind):
    """A copy of each image would take time, so the array is a read-only view of the message's memory."""
    read, make_message, _ = kind
    message = make_message()

    seen = read(message)

    assert np.shares_memory(seen, np.frombuffer(message, np.uint8))
    assert not seen.flags.writeable


def test_a_camera_may_change_its_size():
    """A camera may have another size after the simulator has loaded another world."""
    read = ImageReading("camera")
    read(color())

    seen = read(image(np.zeros((4, 5, 4), np.uint8), "bgra8", 4, frame_id="r"))

    assert seen.shape == (4, 5, 4)


@pytest.mark.parametrize("known", [False, True], ids=["first", "later"])
def test_a_message_cut_short_anywhere_is_refused(kind, known):
    """A reader that accepted the message would return pixels of the previous image."""
    read, make_message, _ = kind
    sound = make_message()
    if known:
        read(sound)

    for length in range(len(sound)):
        with pytest.raises((ValueError, struct.error)):
            read(sound[:length])


def test_a_message_that_is_too_long_is_refused(kind):
    """A message with more bytes than its type needs was sent to the wrong topic."""
    read, make_message, _ = kind
    sound = make_message()

    with pytest.raises(ValueError, match=f"a message of {len(sound) + 1} bytes instead of {len(sound)}"):
        read(memoryview(bytes([*sound, 0])))


REFUSED = {
    "another encoding": (
        ImageReading("camera"),
        color(encoding="rgb8"),
        "an image in rgb8, little-endian, instead of bgra8",
    ),
    "big-endian": (
        ImageReading("camera"),
        color(is_bigendian=1),
        "an image in bgra8, big-endian, instead of bgra8",
    ),
    "padded rows": (ImageReading("camera"), color(step=16), "3 x 2 pixels with 16 bytes a row and 24 in all"),
    "missing rows": (
        ImageReading("camera"),
        color(height=3),
        "3 x 3 pixels with 12 bytes a row and 24 in all",
    ),
    "negative": (RangesReading("depth"), depth(METERS - 1.0), "negative or NaN from depth"),
    "NaN": (RangesReading("depth"), depth(METERS * np.float32(math.nan)), "negative or NaN from depth"),
    "another order": (
        PointsReading("lidar"),
        cloud(names=("x", "z", "y", "layer", "time")),
        "without float32 fields x, y",
    ),
    "no coordinates": (
        PointsReading("lidar"),
        cloud(names=("a", "b", "c", "layer", "time")),
        "without float32 fields x, y",
    ),
    "big-endian points": (PointsReading("lidar"), cloud(is_bigendian=True), "without float32 fields x, y, z"),
    "another length": (
        PointsReading("lidar"),
        cloud(point_step=16),
        "2 points with 16 bytes each and 40 in all",
    ),
    "short points": (
        PointsReading("lidar"),
        cloud(point_step=8, width=5),
        "5 points with 8 bytes each and 40 in all",
    ),
}


@pytest.mark.parametrize(("read", "message", "fact"), REFUSED.values(), ids=REFUSED.keys())
def test_a_message_of_another_format_is_refused(read, message, fact):
    """With a wrong format, a policy would learn from noise."""
    with pytest.raises(ValueError, match=fact):
        read(message)
