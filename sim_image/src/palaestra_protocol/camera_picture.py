"""The newest picture of a robot's camera, as JSON data for viewers.

A viewer may read the picture through the proxy of a Kubernetes API server. Our client for that server returns
text, so the pixels are encoded in base64.
"""

from __future__ import annotations

import base64
import binascii
import zlib
from dataclasses import dataclass
from typing import Any, Final, Self

from palaestra_protocol.fields import MOST_NAME, Fields, ProtocolError, clipped

MOST_SIDE: Final = 320  # pixels in a row or column; a writer leaves out rows and columns of a larger picture
MOST_PICTURE_BYTES: Final = 2**19
_COLORS: Final = 3
_FAST: Final = 1  # the compression level for zlib: the fastest
_MOST_TEXT: Final = MOST_PICTURE_BYTES - 2**10  # maximum length of a picture in base64


@dataclass(frozen=True, slots=True, kw_only=True)
class CameraPicture:
    """One picture.

    Attributes:
        name: the name of the camera.
        width: the number of pixels in a row, at most MOST_SIDE.
        height: the number of rows, at most MOST_SIDE.
        pixels: three bytes for each pixel (red, green, blue), row by row from the top left.
    """

    name: str
    width: int
    height: int
    pixels: bytes

    def to_json(self) -> dict[str, Any]:
        """Return the picture as JSON data; the pixels are compressed."""
        return {
            "name": clipped(self.name, MOST_NAME),
            "width": self.width,
            "height": self.height,
            "pixels": base64.b64encode(zlib.compress(self.pixels, _FAST)).decode(),
        }

    @classmethod
    def from_json(cls, content: object, path: str = "") -> Self:
        """Return the object that `to_json` wrote.

        Raises:
            ProtocolError: `content` does not have this format.
        """
        fields = Fields(content, path)
        width, height = fields.whole("width", 1, MOST_SIDE), fields.whole("height", 1, MOST_SIDE)
        size = _COLORS * width * height
        try:
            packed = base64.b64decode(fields.text("pixels", _MOST_TEXT), validate=True)
            pixels = zlib.decompressobj().decompress(packed, size + 1)
        except (binascii.Error, zlib.error) as error:
            raise fields.error("pixels", f"is not compressed ({error})") from error
        if len(pixels) != size:
            raise ProtocolError(f"{path or 'body'}.pixels: is not {width} by {height} pixels")
        return cls(name=fields.text("name", MOST_NAME), width=width, height=height, pixels=pixels)
