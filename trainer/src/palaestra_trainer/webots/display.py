"""A robot's display: a program draws lines, shapes, texts and images on it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from palaestra_trainer.errors import ConfigurationError, WrongData
from palaestra_trainer.webots.device import Fact
from palaestra_trainer.webots.outputs import OutputDevice

_FORMATS: Final = (3, 4)  # WB_IMAGE_RGB, WB_IMAGE_RGBA: also the number of channels. Source: webots/display.h
_DIMENSIONS: Final = 3  # of an image: height, width, channels
_SHOWN: Final = 0  # the handle of the visible image
Point = tuple[int, int]


class Display(OutputDevice):
    """A display; points are x and y in pixels, from the upper left corner.

    A drawing has the color, alpha and opacity that were set last. Every method may raise SimulatorDead,
    SimulatorHung or WrongData.
    """

    __slots__ = ()
    nodes = ("Display",)
    size = Fact(
        "get_info",
        "display_get_info",
        lambda it: (int(it.width), int(it.height)),
        "Width and height in pixels.",
    )

    def set_color(self, rgb: int) -> None:
        """Set the color of the next drawings, 0xRRGGBB."""
        self._command("set_color", "set_int", value=rgb)

    def set_alpha(self, alpha: float) -> None:
        """Set the alpha of the pixels that the next drawings set: 0 (transparent) to 1."""
        self._command("set_alpha", "set_float", value=alpha)

    def set_opacity(self, opacity: float) -> None:
        """Set the weight of the next drawings against the old pixels: 0 (no effect) to 1 (replace)."""
        self._command("set_opacity", "set_float", value=opacity)

    def set_font(self, name: str, size: int, *, smooth: bool = True) -> None:
        """Set the font of the next texts.

        Args:
            name: a font of Webots, such as "Arial"; the stub and MuJoCo have one font only.
            size: height in pixels.
            smooth: whether the edges are smoothed.

        Raises:
            ConfigurationError: the size is not positive; Webots would ignore it.
        """
        if size <= 0:
            raise ConfigurationError(f"{self.device}: the font size {size} is not positive; use 1 or more")
        self._command("set_font", "display_set_font", font=name, size=size, antiAliasing=int(smooth))

    def draw_pixel(self, at: Point) -> None:
        """Draw a pixel."""
        self._command("draw_pixel", "display_draw_pixel", x1=at[0], y1=at[1])

    def draw_line(self, start: Point, end: Point) -> None:
        """Draw a line between two points."""
        self._command("draw_line", "display_draw_line", x1=start[0], y1=start[1], x2=end[0], y2=end[1])

    def draw_rectangle(self, corner: Point, size: tuple[int, int], *, fill: bool = False) -> None:
        """Draw a rectangle from its upper left corner; if `fill`, with its interior."""
        x, y, (width, height) = *corner, size
        self._draw("rectangle", fill=fill, x=x, y=y, width=width, height=height)

    def draw_oval(self, middle: Point, radii: tuple[int, int], *, fill: bool = False) -> None:
        """Draw an ellipse with a horizontal and a vertical radius; if `fill`, with its interior."""
        self._draw("oval", fill=fill, cx=middle[0], cy=middle[1], a=radii[0], b=radii[1])

    def draw_polygon(self, corners: Sequence[Point], *, fill: bool = False) -> None:
        """Draw a closed polygon; if `fill`, with its interior."""
        xs, ys = [x for x, _ in corners], [y for _, y in corners]
        self._draw("polygon", fill=fill, x=xs, y=ys, size=len(xs))

    def draw_text(self, text: str, at: Point) -> None:
        """Draw a text from its upper left corner."""
        self._command("draw_text", "display_draw_text", text=text, x=at[0], y=at[1])

    def draw_image(self, image: NDArray[np.uint8], at: Point = (0, 0), *, blend: bool = False) -> None:
        """Draw an image from its upper left corner.

        Args:
            image: shape (height, width, 3) for RGB, or (height, width, 4) for RGBA; uint8.
            at: the upper left corner.
            blend: whether alpha mixes the image with the old pixels; otherwise the image replaces them.

        Raises:
            ConfigurationError: the array has another shape or dtype.
        """
        channels = image.shape[-1] if image.ndim == _DIMENSIONS else 0
        if channels not in _FORMATS or image.dtype != np.uint8 or not image.size:
            raise ConfigurationError(
                f"{self.device}: an image of shape {image.shape} and dtype {image.dtype} cannot be drawn;"
                " use (height, width, 3) or (height, width, 4) and uint8"
            )
        height, width, _ = image.shape
        pixels = np.ascontiguousarray(image).tobytes()
        self._paste("image_new", at, blend=blend, width=width, height=height, data=pixels, format=channels)

    def draw_file(self, file: str | Path, at: Point = (0, 0), *, blend: bool = False) -> None:
        """Draw an image file of the simulator's machine; see `draw_image`.

        Raises:
            WrongData: also if the simulator cannot read the file.
        """
        self._paste("image_load", at, blend=blend, filename=str(file))

    def copy(self, corner: Point, size: tuple[int, int], to: Point, *, blend: bool = False) -> None:
        """Copy a rectangle of the display to another place; see `draw_image`.

        Args:
            corner: the upper left corner of the rectangle.
            size: its width and height in pixels.
            to: the upper left corner of the copy.
            blend: as in `draw_image`.
        """
        (x, y), (width, height) = corner, size
        self._paste("image_copy", to, blend=blend, x=x, y=y, width=width, height=height)

    def save(self, file: str | Path) -> None:
        """Save the visible image as a PNG or JPEG file on the simulator's machine.

        Raises:
            WrongData: also if the simulator cannot write the file.
        """
        self._command("image_save", "display_image_save", filename=str(file), ir=_SHOWN)

    def attach_camera(self, camera: str) -> None:
        """Show the image of a camera of the same size behind the drawings.

        Raises:
            WrongData: also if the robot has no such camera, or the simulator does not render.
        """
        self._command("attach_camera", "set_string", value=camera)

    def detach_camera(self) -> None:
        """Remove the image of the camera."""
        self.call("detach_camera", "get_bool", ask=True)

    def _draw(self, shape: str, *, fill: bool, **numbers: Any) -> None:
        self._command(f"{'fill' if fill else 'draw'}_{shape}", f"display_draw_{shape}", **numbers)

    def _paste(self, make: str, at: Point, *, blend: bool, **request: Any) -> None:
        """Make an image in the simulator, draw it, and delete it."""
        handle = self.call(make, f"display_{make}", **request).ir
        if not handle:
            of_file = "filename" in request
            given = request["filename"] if of_file else f"{request['width']} x {request['height']} pixels"
            remedy = (
                "use a PNG or JPEG file that the simulator can read" if of_file else "use a smaller image"
            )
            raise WrongData(self.robot, f"{self.device} refuses {make} for {given}; {remedy}")
        try:
            where = {"x": at[0], "y": at[1], "blend": int(blend)}
            self._command("image_paste", "display_image_paste", ir=handle, **where)
        finally:
            self._command("image_delete", "display_image_delete", ir=handle)
