"""Write a bag in which a crash loses at most the last second.

The writer appends to `NAME.mcap.part`. When it is closed, it adds the index and renames the file to
`NAME.mcap`. If the process is killed, the `.part` file stays. `read_bag` reads it up to the last flush, and
`mcap recover NAME.mcap.part -o NAME.mcap` makes a whole file of it.
Source: https://mcap.dev/guides/cli

A flush hands the bytes to the operating system. So a loss of power may also lose bytes that the operating
system has not yet written to the disk. The writer waits for the disk only when it is closed, because a wait
each second would disturb the control loop of a robot.
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Final, Self

from mcap.records import Schema
from mcap_ros2.writer import Writer

from palaestra_protocol.whole_file import sync
from palaestra_trainer.bags.definitions import definition
from palaestra_trainer.bags.messages import nanoseconds
from palaestra_trainer.errors import ConfigurationError

PART: Final = ".part"
METADATA: Final = "palaestra"  # name of the metadata record
_FLUSH_EVERY_NS = 1_000_000_000


class BagWriter:
    """A new bag, as a context manager; an error in the `with` block does not lose what was written before.

    Attributes:
        path: the file that exists after `close`.
        part: the file until then.
    """

    def __init__(self, path: Path, metadata: Mapping[str, str] | None = None) -> None:
        """Begin a bag.

        Args:
            path: the new file.
            metadata: names and values for the metadata record `palaestra`.

        Raises:
            ConfigurationError: the file or its `.part` file exists.
            OSError: the file could not be written.
        """
        self.path, self.part = path, path.with_name(path.name + PART)
        if path.exists():
            raise ConfigurationError(f"{path}: exists; name a new file")
        try:
            self._file = self.part.open("xb")
        except FileExistsError:
            raise ConfigurationError(
                f"{self.part}: exists, from a program that runs or was killed; recover it with "
                f"`mcap recover`, then remove it"
            ) from None
        self._bag = Writer(self._file)
        self._schemas: dict[str, Schema] = {}
        self._types: dict[str, str] = {}
        self._first_waiting_ns: int | None = None  # stamp of the first message since the last flush
        self._bag.add_metadata(METADATA, dict(metadata or {}))
        self._flush()

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def write(self, topic: str, type_name: str, message: Mapping[str, Any], stamp_s: float) -> None:
        """Append a message.

        Args:
            topic: name of the topic, such as `/odom`; all its messages have the same type.
            type_name: one of `definitions.TYPES`.
            message: the content, as `messages` returns it.
            stamp_s: time of the message in seconds. It may be earlier than that of the last message.

        Raises:
            ConfigurationError: the topic has messages of another type, or the time is not one of ROS 2.
            KeyError: the type is unknown.
            OSError: the file could not be written.
        """
        at = nanoseconds(stamp_s)
        if self._types.setdefault(topic, type_name) != type_name:
            raise ConfigurationError(
                f"{topic}: has messages of type {self._types[topic]}, so {type_name} needs another topic"
            )
        if (schema := self._schemas.get(type_name)) is None:
            schema = self._bag.register_msgdef(type_name, definition(type_name))
            self._schemas[type_name] = schema
        self._bag.write_message(topic, schema, message, log_time=at)
        if self._first_waiting_ns is None:
            self._first_waiting_ns = at
        # If a robot's clock is set back by a second or more, the waiting messages are flushed too.
        elif abs(at - self._first_waiting_ns) >= _FLUSH_EVERY_NS:
            self._flush()

    def close(self) -> None:
        """Complete the file and rename it to `path`; a second call does nothing.

        Raises:
            OSError: the file could not be written; the `.part` file stays.
        """
        if self._file.closed:
            return
        with self._file:
            self._bag.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
        self.part.rename(self.path)
        sync(self.path.parent)

    def _flush(self) -> None:
        self._bag._writer.flush()
        self._first_waiting_ns = None
