"""Pictures of a camera in ROS 1 and ROS 2 as images of the size that a policy learned with.

The message is data of another program, so each field is checked before it is used. The function reads only
fields, so it accepts a sensor_msgs/Image of ROS 1 and of ROS 2.
"""

from __future__ import annotations

from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import LinkError
from palaestra_trainer.real_robots.camera import ImageSize, reduced

TOPIC: Final = "image_raw"  # of the drivers' camera nodes; source: CameraROS.cpp
# The places of red, green and blue in a pixel, and the bytes of a pixel.
_PIXELS: Final = {
    "rgb8": ((0, 1, 2), 3),
    "bgr8": ((2, 1, 0), 3),
    "rgba8": ((0, 1, 2), 4),
    "bgra8": ((2, 1, 0), 4),
}


def image_of(message: Any, size: ImageSize) -> NDArray[np.uint8]:
    """Return the picture in a sensor_msgs/Image as an RGB image of a size; see `reduced`.

    Raises:
        LinkError: the encoding is not one of four with colors, the fields contradict each other, or the
            picture is too large or has another ratio of width to height.
    """
    from PIL import Image

    if message.encoding not in _PIXELS:
        known = ", ".join(_PIXELS)
        raise LinkError(
            f"camera: the encoding {message.encoding[:20]!r} does not have the colors that the policy sees; "
            f"let the camera publish one of {known}"
        )
    colors, pixel_bytes = _PIXELS[message.encoding]
    width, height, step = message.width, message.height, message.step
    row_bytes = width * pixel_bytes
    if not (width and height) or step < row_bytes or len(message.data) != height * step:
        raise LinkError(
            f"camera: a picture of {width} x {height} pixels in {message.encoding} cannot have {step} bytes "
            f"a row and {len(message.data)} in all"
        )
    rows = np.frombuffer(message.data, np.uint8).reshape(height, step)[:, :row_bytes]
    pixels = rows.reshape(height, width, pixel_bytes)[:, :, colors]
    return reduced(Image.fromarray(np.ascontiguousarray(pixels)), size)
