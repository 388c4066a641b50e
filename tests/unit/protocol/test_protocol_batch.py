"""The frames between a trainer and a simulator with copies; a reader checks each size before it uses it."""

import struct

import pytest

from palaestra_protocol.batch import (
    HEADER,
    MARK,
    MOST_BYTES,
    BatchDescription,
    BatchRequest,
    FrameKind,
    ResetParts,
    description_of,
    frame,
    json_frame,
    kind_and_length,
    read_frame,
    read_parts,
    request_of,
    reset_frame,
    reset_parts,
)
from palaestra_protocol.fields import ProtocolError

REQUEST = BatchRequest(period_ms=192, motors=("wheel",), commanded="velocity", sensors=("ir1", "ir2"))
EMPTY = memoryview(b"")


def content(whole):
    """Return the content of a frame, after its header."""
    kind, length = kind_and_length(whole[: HEADER.size])
    assert len(whole) == HEADER.size + length
    return kind, memoryview(whole[HEADER.size :])


def test_a_request_and_its_description_are_read_as_they_were_written() -> None:
    """Trainer and simulator use the same declaration of each message, so a change reaches both."""
    description = BatchDescription(rows=2, basic_step_ms=32, units=("V", "V"))

    asked, offered = (
        content(json_frame(FrameKind.OPEN, REQUEST)),
        content(json_frame(FrameKind.OPENED, description)),
    )

    assert (asked[0], request_of(bytes(asked[1]))) == (FrameKind.OPEN, REQUEST)
    assert (offered[0], description_of(bytes(offered[1]))) == (FrameKind.OPENED, description)


def test_a_reset_and_a_response_are_read_as_they_were_written() -> None:
    """The module only splits a frame into byte strings; trainer and simulator make arrays of them."""
    parts = ResetParts(
        rows=memoryview(struct.pack("<2I", 0, 3)), seeds=memoryview(struct.pack("<2q", 7, 8)),
        places=EMPTY, joints=memoryview(struct.pack("<2d", 0.5, 1.5)), commands=EMPTY,
    )  # fmt: skip
    _, reset = content(reset_frame(2, parts))
    _, read = content(read_frame(b"v" * 32, b"p" * 48, b"\x00\x01", {1: "not finite"}))

    assert reset_parts(reset, robot=False, joints=1, motors=0) == parts
    assert read_parts(read, rows=2, values=2) == (b"v" * 32, b"p" * 48, b"\x00\x01", {1: "not finite"})


@pytest.mark.parametrize(
    "header",
    [
        HEADER.pack(b"XX", FrameKind.STEP, 0),
        HEADER.pack(MARK, 99, 0),
        HEADER.pack(MARK, FrameKind.STEP, MOST_BYTES + 1),
    ],
    ids=["mark", "kind", "length"],
)
def test_a_header_of_another_protocol_is_refused(header) -> None:
    """A browser or a port scanner must not make the simulator reserve gigabytes."""
    with pytest.raises(ProtocolError, match="something else than a frame"):
        kind_and_length(header)


def test_frames_of_another_length_are_refused() -> None:
    """An array of another size would be cut into wrong rows."""
    with pytest.raises(ProtocolError, match="should have 12"):
        reset_parts(memoryview(struct.pack("<IB", 1, 0)), robot=False, joints=0, motors=0)
    with pytest.raises(ProtocolError, match="without rows"):
        reset_parts(memoryview(b""), robot=True, joints=0, motors=0)
    with pytest.raises(ProtocolError, match="too short for 4 rows"):
        read_parts(memoryview(b"1234"), rows=4, values=1)
    with pytest.raises(ProtocolError, match="not texts by row"):
        read_parts(memoryview(b"[1]"), rows=0, values=1)
    with pytest.raises(ProtocolError, match="longer than"):
        frame(FrameKind.STEP, bytes(MOST_BYTES + 1))


def test_another_version_is_refused_with_the_remedy() -> None:
    """Images of two releases may meet in one pod."""
    newer = {**REQUEST.to_json(), "version": 2}

    with pytest.raises(ProtocolError, match="version: 2 is not 1; use images of one release"):
        request_of(str(newer).replace("'", '"').encode())
