"""A camera's picture as data: a reader returns the written picture, and rejects an unbounded one."""

import base64
import json
import os
import zlib

import pytest

from palaestra_protocol.camera_picture import MOST_PICTURE_BYTES, MOST_SIDE, CameraPicture
from palaestra_protocol.fields import ProtocolError

PICTURE = CameraPicture(name="eye", width=2, height=1, pixels=b"\x00\x01\x02\xff\xfe\xfd")


def test_what_is_written_is_read_back():
    """The web page must show the colors that the robot's camera sees."""
    assert CameraPicture.from_json(json.loads(json.dumps(PICTURE.to_json()))) == PICTURE


def test_the_largest_picture_fits_into_a_response():
    """The largest message is a picture of noise, which cannot be compressed."""
    noise = os.urandom(3 * MOST_SIDE * MOST_SIDE)
    picture = CameraPicture(name="eye" * 40, width=MOST_SIDE, height=MOST_SIDE, pixels=noise)

    assert len(json.dumps(picture.to_json())) < MOST_PICTURE_BYTES


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"width": 3}, "pixels: is not 3 by 1 pixels"),
        ({"height": MOST_SIDE + 1}, "height: is not between 1 and 320"),
        ({"pixels": "?"}, "pixels: is not compressed"),
        ({"pixels": base64.b64encode(b"raw").decode()}, "pixels: is not compressed"),
        ({"pixels": base64.b64encode(zlib.compress(bytes(10**7))).decode()}, "pixels: is not 2 by 1 pixels"),
    ],
)
def test_a_picture_of_another_size_is_refused(changes, problem):
    """A pod may send a size that does not match its bytes, or a few bytes that decompress into very many."""
    with pytest.raises(ProtocolError, match=problem):
        CameraPicture.from_json(PICTURE.to_json() | changes)
