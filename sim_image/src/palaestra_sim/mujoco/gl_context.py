"""The one canvas of a process: an OpenGL context without a window, loaded for the first picture.

A simulator without cameras needs no OpenGL. One context serves all worlds of a process, one at a time: what a
world has put on it is freed when another one draws, and at the end of the process.
"""

from __future__ import annotations

import atexit
import logging
import os
from functools import cache
from importlib import import_module
from typing import Any, Final

from palaestra_sim.mujoco.library import mujoco
from palaestra_sim.ros_interfaces import UnsimulatedError

_BACKENDS: Final = {
    "egl": "libegl1 libgl1-mesa-dri libopengl0",
    "osmesa": "libosmesa6",
}  # with their packages in Debian
_FONT: Final = mujoco.mjtFontScale.mjFONTSCALE_100.value  # the smallest; no text is drawn


class GlContext:
    """An OpenGL context, and what the present world has put on it."""

    def __init__(self) -> None:
        self._context: Any = _open_context()
        self._drawing: Any = None
        self._owner: object = None
        self._size = (0, 0)
        atexit.register(self.close)  # after the one of mujoco.egl, so it is called before

    def take(self, owner: object, model: Any, size: tuple[int, int]) -> Any:
        """Return the drawing context of a model, with room for a picture of `size`.

        `owner` has the canvas until another one takes it, and always has the same model.
        """
        self._context.make_current()
        if self._owner is not owner or self._drawing is None:
            self.release()
            model.vis.global_.offwidth, model.vis.global_.offheight = size
            self._drawing = mujoco.MjrContext(model, _FONT)
            self._owner, self._size = owner, size
            mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN.value, self._drawing)
            self._drawing.readDepthMap = mujoco.mjtDepthMap.mjDEPTH_ZEROFAR.value
        elif size[0] > self._size[0] or size[1] > self._size[1]:
            self._size = max(size[0], self._size[0]), max(size[1], self._size[1])
            mujoco.mjr_resizeOffscreen(*self._size, self._drawing)
        return self._drawing

    def release(self) -> None:
        """Free what the present world has put on the canvas."""
        if self._drawing is not None:
            self._context.make_current()
            self._drawing.free()
        self._drawing = self._owner = None

    def close(self) -> None:
        """Free everything; safe to repeat."""
        self.release()
        self._context.free()


@cache
def canvas() -> GlContext:
    """Return the canvas of this process.

    Raises:
        UnsimulatedError: this machine cannot draw; the message names what to install.
    """
    return GlContext()


def _open_context() -> Any:
    """Return a context of OpenGL.

    Raises:
        UnsimulatedError: the library is missing, or does not work.
    """
    name = os.environ.get("MUJOCO_GL", "").strip().lower() or "egl"
    if name not in _BACKENDS:
        raise UnsimulatedError(f"MUJOCO_GL={name} draws no pictures; use {' or '.join(_BACKENDS)}")
    # Mesa would otherwise draw with threads of its own, which wait for each other in small pictures.
    os.environ.setdefault("LP_NUM_THREADS", "0")
    # It reports an accelerator that is not needed.
    logging.getLogger("OpenGL.acceleratesupport").setLevel(logging.WARNING)
    try:
        return import_module(f"mujoco.{name}").GLContext(1, 1)
    except (
        Exception
    ) as error:  # libraries of OpenGL fail with ImportError, AttributeError and errors of their own
        raise UnsimulatedError(
            f"pictures need OpenGL ({name}), which does not work here: {error};"
            f" install the Debian packages {_BACKENDS[name]}"
        ) from error
