"""Display: an image that a program draws, optionally on top of the image of a camera.

Text always uses Pillow's built-in font; the name of a requested font is ignored. Cameras do not see displays.
Source: WbDisplay.cpp of Webots.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from typing import Any, Final

from palaestra_sim.ros_interfaces import Fields, Handler, Row, UnsimulatedError
from palaestra_sim.scene import image_buffer, picture_files
from palaestra_sim.scene.devices.camera import Camera
from palaestra_sim.scene.devices.device_type import Carrier, DevicePart, DeviceType
from palaestra_sim.scene.image_buffer import BLACK, OPAQUE, Color, ImageBuffer, Point, on_background
from palaestra_sim.scene.text_rendering import Font, letters

_LARGEST: Final = 4096  # limit for the pixels in a row or column, because a display is a texture in Webots
# Indices of blue, green, red and alpha in a pixel of each format. Source: webots/display.h
_FORMATS: Final = {
    3: (2, 1, 0, None),
    4: (2, 1, 0, 3),
    5: (3, 2, 1, 0),
    6: (0, 1, 2, 3),
    7: (1, 2, 3, 0),
}
_TRANSPARENT: Final = (0, 0, 0, 0)
_WHITE: Final = (OPAQUE, OPAQUE, OPAQUE, OPAQUE)


@dataclass(slots=True, kw_only=True, eq=False)
class Display:
    """A display.

    Attributes:
        picture: the pixels that were drawn.
        color: blue, green, red and alpha for the next drawing.
        opacity: the opacity of the next drawing, from 0 to 255.
        font: the font of the next text.
        images: stored images of clients, by their handles.
        camera: the camera whose image is the background; None without a background.
    """

    name: str
    model: str
    picture: ImageBuffer
    color: Color = _WHITE
    opacity: int = OPAQUE
    font: Font = field(default_factory=Font)
    images: dict[int, ImageBuffer] = field(default_factory=dict)
    camera: Camera | None = None
    _robot: Carrier | None = field(default=None, repr=False)

    @property
    def shown(self) -> ImageBuffer:
        """The visible image: the drawing, on top of the camera's current image."""
        camera = self.camera
        return self.picture if camera is None else on_background(self.picture, camera.value)

    def mount(self, robot: Carrier) -> None:
        """Connect the display to the robot that carries it."""
        self._robot = robot

    def attach(self, name: str) -> bool:
        """Show the image of one of the robot's cameras as background; return whether that device exists.

        Black pixels, such as those without a drawing, become transparent. A second camera has no effect.

        Raises:
            UnsimulatedError: the simulator does not render, or the camera has another size.
        """
        camera = None if self._robot is None else self._robot.device(name)
        if camera is None or self.camera is not None:
            return camera is not None
        if not isinstance(camera, Camera):
            raise UnsimulatedError(f"{name} is not a Camera; attach a Camera")
        if camera.eye is None:
            raise UnsimulatedError(f"{name} has no image in this simulator; use driver mujoco or webots")
        size = self.picture.width, self.picture.height
        if camera.lens.size != size:
            raise UnsimulatedError(
                f"{name} has {camera.lens.size} pixels, but {self.name} has {size}; give both the same size"
            )
        camera.eye.open()
        self.camera = camera
        self.picture.exchange(BLACK, _TRANSPARENT)
        return True

    def keep(self, image: ImageBuffer) -> Fields:
        """Store an image, and return its handle."""
        handle = max(self.images, default=0) + 1
        self.images[handle] = image
        return {"ir": handle}

    def image(self, handle: int) -> ImageBuffer | None:
        """Return an image by its handle; None for 0, the handle of an image that could not be created.

        Raises:
            UnsimulatedError: no image has that handle; Webots would read invalid memory.
        """
        if handle and handle not in self.images:
            raise UnsimulatedError(
                f"the image {handle} does not exist; make one with image_new or image_copy"
            )
        return self.images.get(handle)


def _read(part: DevicePart) -> Display:
    width, height = int(part.number("width", 64.0)), int(part.number("height", 64.0))
    if not 0 < width <= _LARGEST or not 0 < height <= _LARGEST:
        part.refuse(f"a display of {width} by {height} pixels", f"use 1 to {_LARGEST}")
        width = height = 1
    picture = ImageBuffer(width=width, height=height, pixels=bytearray(bytes(BLACK) * (width * height)))
    return Display(name=part.name, model=part.text("model"), picture=picture)


def _services(display: Display) -> tuple[Row, ...]:
    picture = display.picture

    def detach_camera(_request: Any) -> Fields:
        display.camera = None
        return {"value": True}

    return (
        ("get_info", "display_get_info", lambda _: {"width": picture.width, "height": picture.height}),
        ("attach_camera", "set_string", lambda it: {"success": display.attach(it.value)}),
        ("detach_camera", "get_bool", detach_camera),
        *_ink(display),
        *_drawing(display),
        *_images(display),
    )


def _ink(display: Display) -> tuple[Row, ...]:
    def set_color(request: Any) -> Fields:
        blue, green, red = (request.value >> shift & 0xFF for shift in (0, 8, 16))
        display.color = blue, green, red, display.color[3]
        return {"success": True}

    def set_alpha(request: Any) -> Fields:
        display.color = *display.color[:3], int(OPAQUE * _share(request.value))
        return {"success": True}

    def set_opacity(request: Any) -> Fields:
        display.opacity = int(OPAQUE * _share(request.value))
        return {"success": True}

    def set_font(request: Any) -> Fields:
        """Set the size of the font; ignore a size that is not positive, for which Webots prints an error."""
        if request.size > 0:
            display.font = Font(min(request.size, _LARGEST), bool(request.antiAliasing))
        return {"success": 1}

    return (
        ("set_font", "display_set_font", set_font),
        ("set_color", "set_int", set_color),
        ("set_alpha", "set_float", set_alpha),
        ("set_opacity", "set_float", set_opacity),
    )


def _share(value: float) -> float:
    return 0.0 if math.isnan(value) else max(0.0, min(1.0, value))


def _drawing(display: Display) -> tuple[Row, ...]:
    shapes: dict[str, tuple[str, Callable[[Any], Iterable[Point]]]] = {
        "draw_pixel": ("pixel", lambda it: [(it.x1, it.y1)]),
        "draw_line": ("line", lambda it: image_buffer.line(it.x1, it.y1, it.x2, it.y2)),
        "draw_rectangle": ("rectangle", lambda it: image_buffer.rectangle(it.x, it.y, it.width, it.height)),
        "draw_oval": ("oval", lambda it: image_buffer.oval(it.cx, it.cy, it.a, it.b)),
        "draw_polygon": ("polygon", lambda it: image_buffer.outline(_corners(it))),
        "fill_rectangle": (
            "rectangle",
            lambda it: image_buffer.filled_rectangle(it.x, it.y, it.width, it.height),
        ),
        "fill_oval": ("oval", lambda it: image_buffer.filled_oval(it.cx, it.cy, it.a, it.b)),
        "fill_polygon": ("polygon", lambda it: image_buffer.filled_polygon(_corners(it))),
    }

    def draw_text(request: Any) -> Fields:
        _require_small(request)
        picture = display.picture
        size = picture.width, picture.height
        for point, share in letters(request.text, (request.x, request.y), display.font, size):
            picture.draw([point], display.color, display.opacity * share // OPAQUE)
        return {"success": 1}

    def drawer(points: Callable[[Any], Iterable[Point]]) -> Handler:
        def draw(request: Any) -> Fields:
            _require_small(request)
            display.picture.draw(points(request), display.color, display.opacity)
            return {"success": 1}

        return draw

    return (
        *((name, f"display_draw_{type_}", drawer(points)) for name, (type_, points) in shapes.items()),
        ("draw_text", "display_draw_text", draw_text),
    )


def _corners(request: Any) -> list[Point]:
    return list(zip(request.x, request.y, strict=False))[: max(0, request.size)]


def _require_small(request: Any) -> None:
    """Refuse numbers beyond the size of any display, because such a drawing could take minutes."""
    for name, value in request._asdict().items():
        numbers = value if isinstance(value, list | tuple) else [value]
        if any(isinstance(number, int) and abs(number) > _LARGEST for number in numbers):
            raise UnsimulatedError(f"{name} has a number above {_LARGEST}; use a smaller number")


def _images(display: Display) -> tuple[Row, ...]:
    def image_copy(request: Any) -> Fields:
        _require_small(request)
        if request.width < 1 or request.height < 1:
            return {"ir": 0}
        return display.keep(display.shown.copy(request.x, request.y, request.width, request.height))

    def image_paste(request: Any) -> Fields:
        _require_small(request)
        image = display.image(request.ir)
        if image is not None:
            display.picture.paste(image, request.x, request.y, blend=bool(request.blend))
        return {"success": 1}

    def image_delete(request: Any) -> Fields:
        if display.image(request.ir) is not None:
            del display.images[request.ir]
        return {"success": 1}

    def image_new(request: Any) -> Fields:
        _require_small(request)
        image = _image_of(request)
        return {"ir": 0} if image is None else display.keep(image)

    def image_load(request: Any) -> Fields:
        image = picture_files.load(request.filename)
        return {"ir": 0} if image is None else display.keep(image)

    def image_save(request: Any) -> Fields:
        """Save an image, or the visible image for the handle 0."""
        image = display.image(request.ir) or display.shown
        size = image.width, image.height
        return {"success": int(picture_files.save(request.filename, size, image.pixels, alpha=True))}

    return (
        ("image_new", "display_image_new", image_new),
        ("image_copy", "display_image_copy", image_copy),
        ("image_paste", "display_image_paste", image_paste),
        ("image_delete", "display_image_delete", image_delete),
        ("image_load", "display_image_load", image_load),
        ("image_save", "display_image_save", image_save),
    )


def _image_of(request: Any) -> ImageBuffer | None:
    """Return the image that a request creates; None if Webots does not create an image either.

    Missing bytes are 0. Webots would read the memory after the last byte.
    """
    width, height, places = request.width, request.height, _FORMATS.get(request.format)
    if places is None or width < 1 or height < 1:
        return None
    size = 3 if places[3] is None else 4
    count = width * height
    data = bytes(request.data)[: size * count].ljust(size * count, b"\0")
    pixels = bytearray(4 * count)
    for channel, place in enumerate(places):
        pixels[channel::4] = bytes([OPAQUE]) * count if place is None else data[place::size]
    return ImageBuffer(width=width, height=height, pixels=pixels)


DISPLAY: Final = DeviceType(
    node="Display",
    name="display",
    fields="width SFInt32 64; height SFInt32 64",
    read=_read,
    services=_services,
    attach=Display.mount,
)
