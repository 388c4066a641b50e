"""The OpenGL context of the process; it has no window.

The context is opened for the first image, because a simulator without cameras must work without OpenGL. All
worlds of a process share the context; only one world uses it at a time. The OpenGL objects of a world are
freed when another world renders, and at the end of the process.
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

# The OpenGL libraries that MuJoCo can use without a window, each with the Debian packages that it needs.
_BACKENDS: Final = {
    "egl": "libegl1 libgl1-mesa-dri libopengl0",
    "osmesa": "libosmesa6",
}
_FONT: Final = mujoco.mjtFontScale.mjFONTSCALE_100.value  # the smallest font, because no text is rendered


class GlContext:
    """An OpenGL context, and the OpenGL objects of the current world."""

    def __init__(self) -> None:
        self._context: Any = _open_context()
        self._drawing: Any = None
        self._owner: object = None
        self._size = (0, 0)
        atexit.register(self.close)  # runs before the exit hook of mujoco.egl, which was registered earlier

    def take(self, owner: object, model: Any, size: tuple[int, int]) -> Any:
        """Return MuJoCo's rendering context for a model; this context can render images up to `size`.

        The OpenGL objects of `owner` are kept until another owner calls this method. An owner must always
        pass the same model.
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
        """Free the OpenGL objects of the current world."""
        if self._drawing is not None:
            self._context.make_current()
            self._drawing.free()
        self._drawing = self._owner = None

    def close(self) -> None:
        """Free the context and all its objects; safe to call again."""
        self.release()
        self._context.free()


@cache
def canvas() -> GlContext:
    """Return the OpenGL context of this process.

    Raises:
        UnsimulatedError: this machine cannot render; the message names the packages to install.
    """
    return GlContext()


def _open_context() -> Any:
    """Return a new OpenGL context.

    Raises:
        UnsimulatedError: the OpenGL library is missing, or does not work.
    """
    name = os.environ.get("MUJOCO_GL", "").strip().lower() or "egl"
    if name not in _BACKENDS:
        raise UnsimulatedError(f"MUJOCO_GL={name} cannot draw pictures; use {' or '.join(_BACKENDS)}")
    # By default Mesa renders with its own threads. For small images, these threads mostly wait for each
    # other.
    os.environ.setdefault("LP_NUM_THREADS", "0")
    # At the level INFO, this logger reports that an optional accelerator module is missing.
    logging.getLogger("OpenGL.acceleratesupport").setLevel(logging.WARNING)
    try:
        return import_module(f"mujoco.{name}").GLContext(1, 1)
    except Exception as error:  # OpenGL libraries raise ImportError, AttributeError and their own errors
        raise UnsimulatedError(
            f"pictures need OpenGL ({name}), which does not work here: {error};"
            f" install the Debian packages {_BACKENDS[name]}"
        ) from error
