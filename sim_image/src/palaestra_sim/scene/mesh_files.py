"""Read the triangles of mesh files: STL as text or in binary form, and Wavefront OBJ.

Libraries for these formats need NumPy, which the stub does not have, so this module reads the files itself.
It does not read Collada files, which have frames, units and axes of their own.
"""

from __future__ import annotations

import posixpath
import struct
from collections.abc import Iterable, Iterator, Sequence
from typing import Final

from palaestra_sim.scene.geometry import Vector
from palaestra_sim.scene.meshes import CORNERS, MOST_M, Corners, Mesh, Triangle, are_lengths, cut
from palaestra_sim.scene.nodes.scene_node import SceneNode
from palaestra_sim.world.project_files import ReadFile
from palaestra_sim.world.source import Source

MOST_BYTES: Final = 64 << 20
"""Maximum size of all mesh files of a world together."""
MOST_TRIANGLES: Final = 100_000
"""Maximum number of triangles of one file."""
_MOST_CORNERS: Final = 100  # of one face; the time to cut a face grows with the third power of its corners
_HEADER: Final = 80  # bytes of a binary STL file before the number of its triangles
_BINARY: Final = struct.Struct("<3f3f3f3fH")  # the normal and the three corners of a triangle, and a number


class MeshFiles:
    """The mesh files that the nodes of a world name; each file is read once, also if it is wrong.

    Args:
        read: returns the bytes of a file; without it, no file can be read.
    """

    def __init__(self, read: ReadFile | None = None) -> None:
        self._read = read
        # For each file that was read: its mesh, or None and the reason why it has no mesh.
        self._found: dict[tuple[str, str], tuple[Mesh | None, str]] = {}
        self._read_bytes = 0

    def mesh_of(self, node: SceneNode) -> Mesh:
        """Return the triangles of a Mesh.

        Raises:
            ValueError: the Mesh has no file, or its file has no triangles that can be read; the message
                says why.
        """
        address = node.text("url")
        if not address:
            raise ValueError("has no url")
        if node.origin is None or self._read is None:
            raise ValueError(f"{address} cannot be read here")
        key = (node.origin.source.name, address)
        if key not in self._found:
            self._found[key] = self._decoded(self._read, node.origin.source, address)
        found, reason = self._found[key]
        if found is None:
            raise ValueError(reason)
        return found if node.flag("ccw", True) else found.turned

    def _decoded(self, read: ReadFile, namer: Source, address: str) -> tuple[Mesh | None, str]:
        """Return the mesh of a file, or None and the reason why it cannot be read."""
        try:
            data = read(namer, address)
        except OSError as error:
            return None, f"{address}: {error.strerror}"
        self._read_bytes += len(data)
        if self._read_bytes > MOST_BYTES:
            return None, f"{address} and the mesh files before it have more than {MOST_BYTES >> 20} MiB"
        try:
            return decode(data, address), ""
        except ValueError as error:
            return None, f"{address} {error}"


def decode(data: bytes, name: str) -> Mesh:
    """Return the triangles of a mesh file, whose format follows from the ending of its name.

    Raises:
        ValueError: the file has no triangles that can be read; the message says why.
    """
    ending = posixpath.splitext(name)[1].lower()
    if ending == ".stl":
        return _merged(_of_stl(data))
    if ending == ".obj":
        return _merged(_of_obj(data))
    raise ValueError("is neither an STL file nor an OBJ file; convert it to one of them")


def _merged(triangles: Iterable[Corners]) -> Mesh:
    """Return a mesh in which triangles share their equal corners."""
    at: dict[Vector, int] = {}
    found: list[Triangle] = []
    for a, b, c in triangles:
        if len(found) == MOST_TRIANGLES:
            raise ValueError(f"has more than {MOST_TRIANGLES} triangles; use a simpler mesh")
        found.append((at.setdefault(a, len(at)), at.setdefault(b, len(at)), at.setdefault(c, len(at))))
    if not found:
        raise ValueError("has no triangle")
    if not are_lengths(number for point in at for number in point):
        raise ValueError(f"has a corner that is not finite, or farther than {MOST_M:g} m away")
    return Mesh(tuple(at), tuple(found))


def _of_stl(data: bytes) -> Iterator[Corners]:
    """Yield the triangles of an STL file.

    A binary file may begin with `solid`, as a text file does, so the size decides.
    """
    start = _HEADER + 4
    count = int.from_bytes(data[_HEADER:start], "little")
    if len(data) >= start and len(data) == start + count * _BINARY.size:
        for numbers in _BINARY.iter_unpack(data[start:]):
            yield numbers[3:6], numbers[6:9], numbers[9:12]
        return
    if not data.lstrip().startswith(b"solid") or b"\0" in data:
        raise ValueError("is not an STL file, or is cut off")
    corners = []
    for number, words in _lines(data):
        if words[0] == "vertex":
            corners.append(_point(words[1:], number))
            if len(corners) == CORNERS:
                yield corners[0], corners[1], corners[2]
                corners = []
    if corners:
        raise ValueError("has a triangle with too few corners; it may be cut off")


def _of_obj(data: bytes) -> Iterator[Corners]:
    """Yield the triangles of an OBJ file; faces with more corners are cut into triangles."""
    points: list[Vector] = []
    for number, words in _lines(data.replace(b"\\\n", b" ")):
        if words[0] == "v":
            points.append(_point(words[1:4], number))
        elif words[0] == "f":
            face = [_corner(word, len(points), number) for word in words[1:]]
            if not CORNERS <= len(face) <= _MOST_CORNERS:
                raise ValueError(f"line {number} has a face with {len(face)} corners; use triangles")
            for a, b, c in cut(points, face):
                yield points[a], points[b], points[c]


def _lines(data: bytes) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the words of each line that has words."""
    for number, line in enumerate(data.splitlines(), start=1):
        if words := line.decode("ascii", "replace").split():
            yield number, words


def _point(words: Sequence[str], line: int) -> Vector:
    try:
        x, y, z = map(float, words)
    except ValueError as error:
        raise ValueError(f"line {line} does not have three numbers") from error
    return x, y, z


def _corner(word: str, count: int, line: int) -> int:
    """Return the index of a corner, which a file counts from 1, or backward from the last point."""
    try:
        written = int(word.partition("/")[0])
    except ValueError as error:
        raise ValueError(f"line {line} has a corner without a number") from error
    index = written - 1 if written > 0 else count + written
    if not written or not 0 <= index < count:
        raise ValueError(f"line {line} has a corner {written}, but {count} points precede it")
    return index
