"""Read the messages of a bag by topic.

The whole file is read into memory, so its size is bounded. A `.part` file of a killed writer is read up to
its last complete chunk.
"""

from __future__ import annotations

import io
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Final

from mcap.records import Channel, Chunk, DataEnd, McapRecord, Message, Metadata, Schema, Statistics
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_ros2.decoder import DecoderFactory

from palaestra_trainer.bags.writer import METADATA, PART
from palaestra_trainer.errors import ConfigurationError

MOST_BYTES: Final = 256 * 2**20
MOST_UNCOMPRESSED_BYTES: Final = 2**30
_NS = 1_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class BagMessage:
    """One message of a bag.

    Attributes:
        stamp_s: time of the message in seconds.
        type_name: its type, such as `nav_msgs/msg/Odometry`.
        content: its fields as a dict; a field with fields of its own is a dict too.
    """

    stamp_s: float
    type_name: str
    content: Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Bag:
    """The content of a bag.

    Attributes:
        metadata: names and values of the metadata record `palaestra`; empty if the bag lacks it.
        topics: the messages of each topic, in the order of the file.
    """

    metadata: dict[str, str] = field(default_factory=dict)
    topics: dict[str, list[BagMessage]] = field(default_factory=dict)


def read_bag(path: Path) -> Bag:
    """Return the messages of a bag with messages of ROS 2.

    Raises:
        ConfigurationError: the file is too large, damaged, or not such a bag.
        OSError: the file could not be read.
    """
    content = _content(path)
    bag = Bag()
    try:
        _fill(bag, _records(content))
    except Exception as error:  # a damaged file raises errors of MCAP, zstd, struct, the parser and others
        if path.suffix != PART:
            raise ConfigurationError(
                f"{path}: is not a whole bag of ROS 2 ({type(error).__name__}: {error}); write it again, or "
                f"recover its readable part with `mcap recover`"
            ) from error
    return bag


def _content(path: Path) -> bytes:
    with path.open("rb") as file:
        content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise ConfigurationError(
            f"{path}: has more than {MOST_BYTES:,} bytes; copy a part of it with `mcap filter`"
        )
    return content


def _records(content: bytes) -> Iterator[McapRecord]:
    """Yield the records of a file and of its chunks, each chunk after the check of its checksum."""
    uncompressed, ended = 0, False
    for record in StreamReader(io.BytesIO(content), emit_chunks=True, validate_crcs=True).records:
        ended = ended or isinstance(record, DataEnd)
        if not isinstance(record, Chunk):
            yield record
            continue
        uncompressed += record.uncompressed_size
        if uncompressed > MOST_UNCOMPRESSED_BYTES:
            raise ValueError(f"it has more than {MOST_UNCOMPRESSED_BYTES:,} bytes of messages")
        yield from breakup_chunk(record, validate_crc=True)
    if not ended:  # a record with a damaged length may have swallowed all records after it
        raise ValueError("the end of its data is missing")


def _fill(bag: Bag, records: Iterator[McapRecord]) -> None:
    schemas: dict[int, Schema] = {}
    channels: dict[int, Channel] = {}
    factory = DecoderFactory()
    for record in records:
        if isinstance(record, Schema):
            schemas[record.id] = record
        elif isinstance(record, Channel):
            channels[record.id] = record
        elif isinstance(record, Metadata) and record.name == METADATA:
            bag.metadata.update(record.metadata)
        elif isinstance(record, Message):
            channel = channels[record.channel_id]
            schema = schemas[channel.schema_id]
            decode = factory.decoder_for(channel.message_encoding, schema)
            if decode is None:
                raise ValueError(f"{channel.topic} has messages that are not of ROS 2")
            message = BagMessage(
                stamp_s=record.log_time / _NS, type_name=schema.name, content=_plain(decode(record.data))
            )
            bag.topics.setdefault(channel.topic, []).append(message)
        elif isinstance(record, Statistics):
            # A damaged chunk may look like a record of a later version of MCAP, which readers skip.
            found = sum(map(len, bag.topics.values()))
            if found != record.message_count:
                raise ValueError(f"it has {found} of {record.message_count} messages")


def _plain(value: Any) -> Any:
    """Return a decoded message as dicts and lists."""
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    if hasattr(value, "__slots__"):
        return {name: _plain(getattr(value, name)) for name in value.__slots__}
    return value
