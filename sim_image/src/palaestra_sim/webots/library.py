"""libController, the C library through which a controller communicates with Webots.

`Library` declares the types of every function that it calls, so that a wrong call is an error in Python and
not a crash. Strings are `str`, and arrays of a fixed length are tuples.

libController has one lock for all functions: while one thread waits in `robot_step`, every other call waits.
"""

from __future__ import annotations

import ctypes
import os
import re
from collections.abc import Callable, Iterator, Mapping
from importlib import resources
from pathlib import Path
from typing import Any, Final

from palaestra_sim.errors import SimError

_HOME: Final = "WEBOTS_HOME"
_PROTOTYPES: Final = "prototypes.txt"
_FILE: Final = Path("lib", "controller", "libController.so")
_LENGTHS: Final = {"vec2": 2, "vec3": 3, "vec4": 4, "vec6": 6, "mat3": 9, "mat4": 16}
_LINE: Final = re.compile(r"(\w+) +(\w+)\((.*)\)")


class LibraryError(SimError):
    """libController cannot be loaded, or it lacks a function."""


class RecognitionObject(ctypes.Structure):
    """An object that a camera recognized; `wb_camera_recognition_get_objects` returns an array of them."""

    _fields_ = (
        ("id", ctypes.c_int),
        ("position", ctypes.c_double * 3),
        ("orientation", ctypes.c_double * 4),
        ("size", ctypes.c_double * 2),
        ("position_on_image", ctypes.c_int * 2),
        ("size_on_image", ctypes.c_int * 2),
        ("number_of_colors", ctypes.c_int),
        ("colors", ctypes.POINTER(ctypes.c_double)),
        ("model", ctypes.c_char_p),
    )


class LidarPoint(ctypes.Structure):
    """A point of a lidar's point cloud."""

    _fields_ = (
        ("x", ctypes.c_float),
        ("y", ctypes.c_float),
        ("z", ctypes.c_float),
        ("layer_id", ctypes.c_int),
        ("time", ctypes.c_float),
    )


class RadarTarget(ctypes.Structure):
    """A target that a radar detected."""

    _fields_ = (
        ("distance", ctypes.c_double),
        ("received_power", ctypes.c_double),
        ("speed", ctypes.c_double),
        ("azimuth", ctypes.c_double),
    )


class NodeContact(ctypes.Structure):
    """A point where a node touches another node."""

    _fields_ = (("point", ctypes.c_double * 3), ("node_id", ctypes.c_int), ("padding", ctypes.c_int))


def _array(length: int) -> type:
    class Array:
        """An argument that is an array of doubles; Python passes a sequence of that length."""

        @classmethod
        def from_param(cls, values: Any) -> Any:
            return (ctypes.c_double * length)(*values)

    return Array


class _TextArgument:
    """An argument that is a string; Python passes a `str`."""

    @classmethod
    def from_param(cls, text: str) -> ctypes.c_char_p:
        return ctypes.c_char_p(text.encode())


_STRUCTS: Final[Mapping[str, type[ctypes.Structure]]] = {
    it.__name__: it for it in (RecognitionObject, LidarPoint, RadarTarget, NodeContact)
}
_ARGUMENTS: Final[Mapping[str, Any]] = {
    "bool": ctypes.c_bool,
    "int": ctypes.c_int,
    "double": ctypes.c_double,
    "tag": ctypes.c_ushort,
    "ref": ctypes.c_void_p,
    "text": _TextArgument,
    "data": ctypes.c_char_p,
    "ints": ctypes.POINTER(ctypes.c_int),
    "size": ctypes.POINTER(ctypes.c_int),
    **{name: _array(length) for name, length in _LENGTHS.items()},
}
_RESULTS: Final[Mapping[str, Any]] = {
    "void": None,
    "bool": ctypes.c_bool,
    "int": ctypes.c_int,
    "double": ctypes.c_double,
    "tag": ctypes.c_ushort,
    "ref": ctypes.c_void_p,
    "text": ctypes.c_char_p,
    "bytes": ctypes.POINTER(ctypes.c_ubyte),
    "doubles": ctypes.POINTER(ctypes.c_double),
    "floats": ctypes.POINTER(ctypes.c_float),
    **{name: ctypes.POINTER(ctypes.c_double) for name in _LENGTHS},
    **{name: ctypes.POINTER(it) for name, it in _STRUCTS.items()},
}


class Prototype:
    """The types of one function.

    Attributes:
        name: the name of the function, without `wb_`.
        result: the type of the result, in the words of `prototypes.txt`.
        arguments: the types of the arguments.
    """

    def __init__(self, line: str) -> None:
        found = _LINE.fullmatch(line.strip())
        if found is None:
            raise ValueError(f"{line!r} is not a prototype; write: result name(argument, ...)")
        self.result, self.name, arguments = found.groups()
        self.arguments = tuple(it.strip() for it in arguments.split(",") if it.strip())


def _prototypes() -> Iterator[Prototype]:
    text = resources.files("palaestra_sim.webots").joinpath(_PROTOTYPES).read_text("utf-8")
    return (Prototype(line) for line in text.splitlines() if line and not line.startswith("#"))


PROTOTYPE_OF: Final = {it.name: it for it in _prototypes()}
"""The types of each function, by its name without `wb_`."""


class Library:
    """The functions of a loaded libController, by name without `wb_`.

    An array of fixed length is None if the C function returns NULL.

    Args:
        library: the loaded library.
    """

    def __init__(self, library: Any) -> None:
        self._library = library

    def __getattr__(self, name: str) -> Callable[..., Any]:
        """Return a function, with its types declared.

        Raises:
            LibraryError: this release of Webots has no such function.
        """
        prototype = PROTOTYPE_OF.get(name)
        if prototype is None:
            raise AttributeError(name)
        function = _declared(self._library, prototype)
        setattr(self, name, function)
        return function

    def has(self, name: str) -> bool:
        """Return whether this release of Webots has a function."""
        return hasattr(self._library, f"wb_{name}")


def load(environment: Mapping[str, str] = os.environ) -> Library:
    """Return the libController of the Webots that has started this process.

    Raises:
        LibraryError: the library is missing, or cannot be loaded.
    """
    home = environment.get(_HOME)
    if not home:
        raise LibraryError(f"{_HOME} is not set; Webots sets it when it starts this controller")
    file = Path(home) / _FILE
    try:
        return Library(ctypes.CDLL(os.fspath(file)))
    except OSError as error:
        raise LibraryError(f"{file}: {error}; use Webots R2023b or later for Linux") from error


def _declared(library: Any, prototype: Prototype) -> Callable[..., Any]:
    try:
        function = library[f"wb_{prototype.name}"]
    except AttributeError:
        raise LibraryError(
            f"this release of Webots has no function wb_{prototype.name}; use R2023b or later"
        ) from None
    function.restype = _RESULTS[prototype.result]
    function.argtypes = [_ARGUMENTS[it] for it in prototype.arguments]
    if prototype.result == "text":
        function.errcheck = _text
    elif length := _LENGTHS.get(prototype.result):
        function.errcheck = _numbers(length)
    called: Callable[..., Any] = function
    return called


def _text(result: bytes | None, _function: Any, _arguments: Any) -> str:
    return "" if result is None else result.decode(errors="replace")


def _numbers(length: int) -> Callable[..., Any]:
    def numbers(result: Any, _function: Any, _arguments: Any) -> tuple[float, ...] | None:
        return tuple(result[:length]) if result else None

    return numbers
