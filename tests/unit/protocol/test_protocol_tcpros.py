"""Headers and frames of TCPROS as bytes."""

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_protocol.ros.tcpros import (
    MAX_FRAME_BYTES,
    FrameReader,
    FramingError,
    decode_header,
    encode_header,
    frame,
)

NAMES = st.text(st.characters(codec="utf-8", exclude_characters="="), max_size=20)
VALUES = st.text(max_size=40)


@given(st.dictionaries(NAMES, VALUES, max_size=6))
def test_a_header_survives_the_wire(fields):
    """A value may contain any character, even `=`; a name may not contain `=`."""
    framed = encode_header(fields)

    assert decode_header(framed[4:]) == fields


@given(st.lists(st.binary(max_size=50), max_size=8), st.integers(min_value=1, max_value=20))
def test_frames_come_out_as_they_went_in_however_the_stream_is_cut(payloads, size):
    """The network delivers bytes, so a frame may arrive in several pieces."""
    stream = b"".join(map(frame, payloads))
    reader = FrameReader()

    pieces = [stream[at : at + size] for at in range(0, len(stream), size)]

    assert [payload for piece in pieces for payload in reader.feed(piece)] == payloads


@given(st.binary(max_size=60))
def test_arbitrary_bytes_are_a_header_or_refused(data):
    """Any client may connect to the port and send any bytes; the reader must raise no other error."""
    try:
        fields = decode_header(data)
    except FramingError:
        return

    assert all(isinstance(value, str) for value in fields.values())


def test_a_frame_too_large_to_be_true_is_refused():
    """After lost bytes a reader would take other bytes for the length, and wait for gigabytes."""
    with pytest.raises(FramingError, match="more than the limit of"):
        list(FrameReader().feed(struct.pack("<I", MAX_FRAME_BYTES + 1)))
