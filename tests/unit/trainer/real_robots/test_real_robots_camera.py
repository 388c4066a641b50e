"""A picture of a robot's camera becomes the image that a policy learned with, or is refused."""

import io

import numpy as np
import pytest
from PIL import Image

from palaestra_trainer.errors import LinkError
from palaestra_trainer.real_robots.camera import decoded


def jpeg(size, kind="JPEG"):
    """Return a picture whose left half is red and whose right half is blue."""
    width, height = size
    pixels = np.zeros((height, width, 3), np.uint8)
    pixels[:, : width // 2, 0] = pixels[:, width // 2 :, 2] = 250
    written = io.BytesIO()
    Image.fromarray(pixels).save(written, kind, quality=95)
    return written.getvalue()


@pytest.mark.parametrize("size", [(640, 480), (320, 240), (64, 48)])
def test_a_picture_of_any_resolution_becomes_one_image(size):
    """The camera of a real robot has more pixels than that of a simulation."""
    image = decoded(jpeg(size), (64, 48))

    assert (image.shape, image.dtype) == ((48, 64, 3), np.uint8)
    assert image[24, 8].astype(int) == pytest.approx((250, 0, 0), abs=8)
    assert image[24, 56].astype(int) == pytest.approx((0, 0, 250), abs=8)


@pytest.mark.parametrize(
    ("content", "fact"),
    [
        (b"", "returned no JPEG picture"),
        (b"<html>no camera</html>", "returned no JPEG picture"),
        (jpeg((64, 48), "PNG"), "returned no JPEG picture"),
        (jpeg((64, 48))[:-200], "returned no JPEG picture"),
        (jpeg((160, 90)), "x 90 pixels has another aspect ratio than the policy's 64 x 48; set the camera"),
        (jpeg((8192, 4096)), "8192 x 4096 pixels is too large"),
    ],
    ids=["empty", "text", "PNG", "cut off", "wide", "large"],
)
def test_another_content_is_refused(content, fact):
    """A stretched or incomplete picture would show the policy objects in other places."""
    with pytest.raises(LinkError, match=fact):
        decoded(content, (64, 48))
