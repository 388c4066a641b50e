"""Pictures of a robot's camera as images of the size that a policy learned with.

Pillow decodes and reduces a picture. This module imports Pillow at the first picture, because most policies
need no camera.
"""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import LinkError

if TYPE_CHECKING:
    from PIL.Image import Image as Picture

MOST_BYTES: Final = 2**22
_MOST_PIXELS: Final = 2**24
_ASPECT_SLACK: Final = 0.02  # largest relative difference between the aspect ratios of picture and image

ImageSize = tuple[int, int]  # width and height in pixels


def decoded(content: bytes, size: ImageSize) -> NDArray[np.uint8]:
    """Return a JPEG picture as an RGB image of a size; see `reduced`.

    Raises:
        LinkError: the content is no JPEG picture, is too large, or has another ratio of width to height.
    """
    from PIL import Image

    try:
        with Image.open(io.BytesIO(content), formats=("JPEG",)) as picture:
            return reduced(picture, size)
    except (OSError, SyntaxError, ValueError) as error:
        raise LinkError(f"camera: returned no JPEG picture ({error})") from error


def reduced(picture: Picture, size: ImageSize) -> NDArray[np.uint8]:
    """Return a picture as an RGB image of a size, shape (height, width, 3).

    Each pixel of the image is the mean of the pixels of the picture that it covers.

    Raises:
        LinkError: the picture is too large, or has another ratio of width to height.
        OSError: the content of the picture cannot be read.
    """
    from PIL import Image

    (wide, high), (width, height) = picture.size, size
    if wide * high > _MOST_PIXELS:
        raise LinkError(f"camera: a picture of {wide} x {high} pixels is too large")
    if abs(wide * height / (high * width) - 1.0) > _ASPECT_SLACK:
        raise LinkError(
            f"camera: a picture of {wide} x {high} pixels has another aspect ratio than the "
            f"policy's {width} x {height}; set the camera to the ratio of the policy"
        )
    return np.asarray(picture.convert("RGB").resize(size, Image.Resampling.BOX), np.uint8).copy()
