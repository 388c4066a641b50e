"""Pictures of a robot's camera as images of the size that a policy learned with.

Pillow decodes a picture. It is imported with the first picture, because most policies need no camera.
"""

from __future__ import annotations

import io
from typing import Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import LinkError

MOST_BYTES: Final = 2**22
_MOST_PIXELS: Final = 2**24
_ASPECT_SLACK: Final = 0.02  # by which the shape of the picture may differ from that of the image

ImageSize = tuple[int, int]  # width and height in pixels


def decoded(content: bytes, size: ImageSize) -> NDArray[np.uint8]:
    """Return a JPEG picture as an RGB image of a size, shape (height, width, 3).

    Each pixel of the image is the mean of the pixels of the picture that it covers.

    Raises:
        LinkError: the content is no JPEG picture, is too large, or has another ratio of width to height.
    """
    from PIL import Image

    width, height = size
    try:
        with Image.open(io.BytesIO(content), formats=("JPEG",)) as picture:
            wide, high = picture.size
            if wide * high > _MOST_PIXELS:
                raise LinkError(f"camera: a picture of {wide} x {high} pixels is too large")
            if abs(wide * height / (high * width) - 1.0) > _ASPECT_SLACK:
                raise LinkError(
                    f"camera: a picture of {wide} x {high} pixels has another shape than the policy's "
                    f"{width} x {height}; set the camera to that ratio"
                )
            image = picture.convert("RGB").resize(size, Image.Resampling.BOX)
            return np.asarray(image, np.uint8).copy()
    except (OSError, SyntaxError, ValueError) as error:
        raise LinkError(f"camera: returned no JPEG picture ({error})") from error
