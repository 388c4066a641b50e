"""Displays: shapes, texts and images that a client draws."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from typing import Any, Final

from palaestra_sim.ros_controller.served_robot import ServedDevice
from palaestra_sim.ros_interfaces import Fields, Handler, Row
from palaestra_sim.scene.nodes.types import type_number
from palaestra_sim.webots.devices.calls import DeviceCalls, commands, served

_DONE: Final = {"success": 1}
_PIXEL_BYTES: Final = {3: 3, 4: 4, 5: 4, 6: 4, 7: 4}  # bytes of a pixel for each WB_IMAGE_* of display.h
_CAMERA: Final = type_number("Camera")


def display(calls: DeviceCalls) -> ServedDevice:
    """Return a Display."""
    return served(
        calls,
        rows=(
            (
                "get_info",
                "display_get_info",
                lambda _: {"width": calls.get_width(), "height": calls.get_height()},
            ),
            ("attach_camera", "set_string", lambda request: {"success": _attach(calls, request.value)}),
            ("detach_camera", "get_bool", _detacher(calls)),
            *commands(calls, "set_int", "set_color"),
            *commands(calls, "set_float", "set_alpha", "set_opacity"),
            (
                "set_font",
                "display_set_font",
                _doing(lambda it: calls.set_font(it.font, it.size, bool(it.antiAliasing))),
            ),
            *_drawing(calls),
            *_images(calls),
        ),
    )


def _doing(action: Callable[[Any], object]) -> Handler:
    def handle(request: Any) -> Fields:
        action(request)
        return _DONE

    return handle


def _attach(calls: DeviceCalls, name: str) -> bool:
    """Attach a camera of the robot; return False if no camera has that name."""
    tag = calls.library.robot_get_device(name)
    if not tag or calls.library.device_get_node_type(tag) != _CAMERA:
        return False
    calls.attach_camera(tag)
    return True


def _detacher(calls: DeviceCalls) -> Handler:
    def detach(_request: Any) -> Fields:
        calls.detach_camera()
        return {"value": True}

    return detach


def _drawing(calls: DeviceCalls) -> tuple[Row, ...]:
    box, oval, corners = _box, _oval, _corners
    shapes: dict[str, tuple[str, Callable[[Any], tuple[Any, ...]]]] = {
        "draw_pixel": ("pixel", lambda it: (it.x1, it.y1)),
        "draw_line": ("line", lambda it: (it.x1, it.y1, it.x2, it.y2)),
        "draw_rectangle": ("rectangle", box),
        "draw_oval": ("oval", oval),
        "draw_polygon": ("polygon", corners),
        "draw_text": ("text", lambda it: (it.text, it.x, it.y)),
        "fill_rectangle": ("rectangle", box),
        "fill_oval": ("oval", oval),
        "fill_polygon": ("polygon", corners),
    }
    return tuple(
        (name, f"display_draw_{shape}", _doing(_drawer(getattr(calls, name), arguments)))
        for name, (shape, arguments) in shapes.items()
    )


def _drawer(function: Callable[..., Any], arguments: Callable[[Any], tuple[Any, ...]]) -> Callable[..., Any]:
    return lambda request: function(*arguments(request))


def _box(request: Any) -> tuple[int, ...]:
    return request.x, request.y, request.width, request.height


def _oval(request: Any) -> tuple[int, ...]:
    return request.cx, request.cy, request.a, request.b


def _corners(request: Any) -> tuple[Any, Any, int]:
    """Return the corners of a polygon; Webots' controller would read beyond lists that are too short."""
    size = max(0, min(request.size, len(request.x), len(request.y)))
    numbers = ctypes.c_int * size
    return numbers(*request.x[:size]), numbers(*request.y[:size]), size


def _images(calls: DeviceCalls) -> tuple[Row, ...]:
    return (
        ("image_new", "display_image_new", lambda request: {"ir": _new(calls, request)}),
        (
            "image_copy",
            "display_image_copy",
            lambda it: {"ir": calls.image_copy(it.x, it.y, it.width, it.height) or 0},
        ),
        (
            "image_paste",
            "display_image_paste",
            _doing(lambda it: calls.image_paste(it.ir, it.x, it.y, bool(it.blend))),
        ),
        ("image_delete", "display_image_delete", _doing(lambda it: calls.image_delete(it.ir))),
        ("image_load", "display_image_load", lambda it: {"ir": calls.image_load(it.filename) or 0}),
        ("image_save", "display_image_save", _doing(lambda it: calls.image_save(it.ir or None, it.filename))),
    )


def _new(calls: DeviceCalls, request: Any) -> int:
    """Return the handle of a new image, or 0 if the image cannot be created.

    Missing bytes are 0; Webots would read beyond the end of the data.
    """
    size = _PIXEL_BYTES.get(request.format, 0) * request.width * request.height
    if size <= 0:
        return 0
    data = bytes(request.data)[:size].ljust(size, b"\0")
    image: int = calls.image_new(request.width, request.height, data, request.format) or 0
    return image
