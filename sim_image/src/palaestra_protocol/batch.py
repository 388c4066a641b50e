"""The protocol between a trainer and one simulator that steps many copies of a world.

The simulator listens on a loopback address. The trainer sends one request and waits for its response; each
request covers all rows, and a row is one copy of the world. Every frame begins with `HEADER`: a mark, the
`FrameKind` of the frame, and the number of bytes that follow. Numbers are little-endian. Arrays are stored
row by row.

| request    | content                                              | response  |
|------------|------------------------------------------------------|-----------|
| `OPEN`     | `BatchRequest` as JSON                               | `OPENED`  |
| `STEP`     | float64 commands (rows, motors)                      | `READ`    |
| `RESET`    | see `reset_frame`                                    | `READ`    |

`OPENED` holds a `BatchDescription` as JSON. `READ` holds float64 values (rows, values), float64 poses (rows,
3: x and y in meters, heading in radians), one byte for each row (1 if the row failed), and the reasons as
JSON by row. The response to `RESET` has only the rows of the request. A `REFUSED` frame holds the reason
as text. A command that is NaN leaves its motor as it is.

The module neither opens a connection nor interprets an array.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Annotated, Final, NamedTuple, TypeVar

from palaestra_protocol.fields import MOST_NAME, ProtocolError, decoded
from palaestra_protocol.messages import JsonMessage, JsonRequest, Lines, Number, PartList, Text, Whole

VERSION: Final = 1
MOST_ROWS: Final = 4096
MOST_DEVICES: Final = 256
MOST_SHAPES: Final = 4096
MOST_BYTES: Final = 2**25  # largest size of one frame: 4096 rows with 1024 numbers each
MOST_REASONS: Final = 16  # if more rows fail, the frame leaves out their reasons
LONGEST_REASON: Final = 200
MARK: Final = b"PB"
HEADER: Final = struct.Struct("<2sBxI")
POSE_VALUES: Final = 3
PLACE_VALUES: Final = 6  # x and y in meters, and a quaternion x, y, z, w
_NUMBER: Final = 8
_ROW: Final = 4


class FrameKind(IntEnum):
    """The kinds of frames."""

    OPEN = 1
    OPENED = 2
    STEP = 3
    RESET = 4
    READ = 5
    REFUSED = 6


_KINDS: Final = frozenset(int(kind) for kind in FrameKind)


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchRequest(JsonRequest):
    """The devices, the robot and the joints of the world that the trainer uses, and the period of a step.

    Attributes:
        version: the version of this protocol.
        period_ms: simulated milliseconds of one step.
        motors: the names of the commanded motors, in the order of the commands.
        commanded: the quantity of a command: `velocity`, `position`, `force`, `torque` or `control`.
        sensors: the names of the sensors, in the order of the values.
        robot: the DEF name of the robot; `READ` has its pose, and a reset sets its place. "": no robot.
        mark: the DEF name of a node that only shows a target; "": no mark.
        joints: the DEF names of the joints whose positions a reset sets.
    """

    version: Annotated[int, Whole()] = VERSION
    period_ms: Annotated[int, Whole(1, 3_600_000)]
    motors: Annotated[tuple[str, ...], Lines(MOST_NAME, MOST_DEVICES)]
    commanded: Annotated[str, Text(MOST_NAME)]
    sensors: Annotated[tuple[str, ...], Lines(MOST_NAME, MOST_DEVICES)]
    robot: Annotated[str, Text(MOST_NAME)] = ""
    mark: Annotated[str, Text(MOST_NAME)] = ""
    joints: Annotated[tuple[str, ...], Lines(MOST_NAME, MOST_DEVICES)] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchShape(JsonMessage):
    """One shape of an object on the floor: a box or an upright cylinder; lengths are in meters.

    Attributes:
        name: the DEF name of the object; `FLOOR` for the floor.
        x, y, z: the position of the object.
        heading_rad: the rotation of the object about z.
        center_x, center_y, center_z: the center of the shape, in the frame of the object.
        half_x, half_y, half_z: half the size of the shape.
        radius: the radius of a cylinder; 0 for a box.
    """

    name: Annotated[str, Text(MOST_NAME)]
    x: Annotated[float, Number()]
    y: Annotated[float, Number()]
    z: Annotated[float, Number()]
    heading_rad: Annotated[float, Number()]
    center_x: Annotated[float, Number()]
    center_y: Annotated[float, Number()]
    center_z: Annotated[float, Number()]
    half_x: Annotated[float, Number()]
    half_y: Annotated[float, Number()]
    half_z: Annotated[float, Number()]
    radius: Annotated[float, Number(0.0)]


@dataclass(frozen=True, slots=True, kw_only=True)
class BatchDescription(JsonMessage):
    """The simulator's response to a `BatchRequest`.

    Attributes:
        version: the version of this protocol.
        rows: the number of copies of the world.
        basic_step_ms: the basic step of the world; a period is a multiple of it.
        units: the unit of each sensor of the request, one value each.
        shapes: the objects on the floor, in the order of the world.
    """

    version: Annotated[int, Whole()] = VERSION
    rows: Annotated[int, Whole(1, MOST_ROWS)]
    basic_step_ms: Annotated[int, Whole(1)]
    units: Annotated[tuple[str, ...], Lines(MOST_NAME, MOST_DEVICES)]
    shapes: Annotated[tuple[BatchShape, ...], PartList(BatchShape, MOST_SHAPES)] = ()


_Message = TypeVar("_Message", BatchRequest, BatchDescription)


class ReadParts(NamedTuple):
    """The parts of a `READ` frame, as bytes of the received frame."""

    values: memoryview
    poses: memoryview
    failed: memoryview
    reasons: Mapping[int, str]


class ResetParts(NamedTuple):
    """The parts of a `RESET` frame, as bytes of the received frame: see `reset_frame`."""

    rows: memoryview
    seeds: memoryview
    places: memoryview
    joints: memoryview
    commands: memoryview


def frame(kind: FrameKind, *parts: bytes | memoryview) -> bytes:
    """Return a whole frame.

    Raises:
        ProtocolError: the parts are longer than a frame may be.
    """
    body = b"".join(parts)
    if len(body) > MOST_BYTES:
        raise ProtocolError(f"a frame of {len(body)} bytes is longer than {MOST_BYTES}; use fewer rows")
    return HEADER.pack(MARK, kind, len(body)) + body


def kind_and_length(header: bytes | memoryview) -> tuple[FrameKind, int]:
    """Return the kind of a frame and the length of its content, from the header.

    Raises:
        ProtocolError: `header` is not a header of this protocol.
    """
    mark, kind, length = HEADER.unpack(header)
    if mark != MARK or kind not in _KINDS or length > MOST_BYTES:
        raise ProtocolError("a peer sent something else than a frame of the batch protocol")
    return FrameKind(kind), length


def json_frame(kind: FrameKind, message: JsonMessage) -> bytes:
    """Return a frame with a JSON message."""
    return frame(kind, json.dumps(message.to_json()).encode())


def request_of(content: bytes) -> BatchRequest:
    """Return the request in an `OPEN` frame.

    Raises:
        ProtocolError: the content is not a request, or has another version of the protocol.
    """
    return _of_this_version(BatchRequest.from_json(decoded(content, MOST_BYTES)))


def description_of(content: bytes) -> BatchDescription:
    """Return the description in an `OPENED` frame.

    Raises:
        ProtocolError: the content is not a description, or has another version of the protocol.
    """
    return _of_this_version(BatchDescription.from_json(decoded(content, MOST_BYTES)))


def reset_frame(rows: int, parts: ResetParts) -> bytes:
    """Return the frame that resets `rows` rows.

    The parts are: uint32 row numbers, which increase (rows,); int64 seeds (rows,); float64 places of the
    robot (rows, 6), empty without a robot; float64 positions of the joints (rows, joints); float64 commands
    (rows, motors).
    """
    return frame(FrameKind.RESET, struct.pack("<I", rows), *parts)


def reset_parts(content: memoryview, *, robot: bool, joints: int, motors: int) -> ResetParts:
    """Return the parts of a `RESET` frame.

    Raises:
        ProtocolError: the length of the frame does not fit these parts.
    """
    if len(content) < _ROW:
        raise ProtocolError("a reset without rows; name them")
    (rows,) = struct.unpack("<I", content[:_ROW])
    sizes = [rows * size for size in (_ROW, _NUMBER, PLACE_VALUES * _NUMBER * robot)]
    sizes += [rows * count * _NUMBER for count in (joints, motors)]
    return ResetParts(*_split(content[_ROW:], sizes))


def read_frame(values: bytes, poses: bytes, failed: bytes, reasons: Mapping[int, str]) -> bytes:
    """Return the response to a step or a reset; only the first `MOST_REASONS` reasons are sent."""
    kept = {str(row): reasons[row][:LONGEST_REASON] for row in list(reasons)[:MOST_REASONS]}
    return frame(FrameKind.READ, values, poses, failed, json.dumps(kept).encode() if kept else b"")


def read_parts(content: memoryview, *, rows: int, values: int) -> ReadParts:
    """Return the parts of a `READ` frame that has `rows` rows with `values` values each.

    Raises:
        ProtocolError: the frame is too short, or its last part is not a JSON object of reasons by row.
    """
    sizes = [rows * values * _NUMBER, rows * POSE_VALUES * _NUMBER, rows]
    if len(content) < sum(sizes):
        raise ProtocolError(f"a response of {len(content)} bytes is too short for {rows} rows")
    numbers, poses, failed = _split(content[: sum(sizes)], sizes)
    return ReadParts(numbers, poses, failed, _reasons(bytes(content[sum(sizes) :])))


def _reasons(content: bytes) -> dict[int, str]:
    if not content:
        return {}
    found = decoded(content, MOST_BYTES)
    if not isinstance(found, dict) or not all(str(row).isdigit() for row in found):
        raise ProtocolError("the reasons of failed rows are not texts by row")
    return {int(row): str(text)[:LONGEST_REASON] for row, text in found.items()}


def _split(content: memoryview, sizes: Sequence[int]) -> list[memoryview]:
    if sum(sizes) != len(content):
        raise ProtocolError(f"a frame of {len(content)} bytes should have {sum(sizes)}")
    parts, first = [], 0
    for size in sizes:
        parts.append(content[first : first + size])
        first += size
    return parts


def _of_this_version(message: _Message) -> _Message:
    if message.version != VERSION:
        raise ProtocolError(f"version: {message.version} is not {VERSION}; use images of one release")
    return message
