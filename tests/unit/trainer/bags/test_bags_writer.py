"""A bag has each message as it was written, even after a crash."""

import math
import signal
import subprocess
import sys

import pytest
from hypothesis import given
from hypothesis import strategies as st

from palaestra_trainer.bags import definitions, messages
from palaestra_trainer.bags.reader import read_bag
from palaestra_trainer.bags.writer import BagWriter
from palaestra_trainer.errors import ConfigurationError

LENGTHS = st.floats(-1e6, 1e6)
TRIPLES = st.tuples(LENGTHS, LENGTHS, LENGTHS)
STAMPS = st.integers(0, 2**31 - 1).map(float)
SINGLES = st.floats(width=32)  # the type of the numbers in scans and arrays
ROWS = st.one_of(
    st.tuples(st.just(definitions.ODOMETRY), st.builds(messages.odometry, STAMPS, TRIPLES, TRIPLES)),
    st.tuples(st.just(definitions.ODOMETRY), st.builds(messages.odometry, STAMPS, TRIPLES, st.none())),
    st.tuples(st.just(definitions.TWIST), st.builds(messages.twist, TRIPLES)),
    st.tuples(
        st.just(definitions.LASER_SCAN),
        st.builds(messages.ranges, STAMPS, st.lists(SINGLES, min_size=1), st.just((0.03, 0.4))),
    ),
    st.tuples(st.just(definitions.BOOL), st.builds(messages.bump, touched=st.booleans())),
    st.tuples(st.just(definitions.FLOATS), st.builds(messages.numbers, st.lists(SINGLES), st.text())),
    st.tuples(st.just(definitions.POSE), st.builds(messages.target, STAMPS, LENGTHS, LENGTHS, st.text())),
    st.tuples(st.just(definitions.TRANSFORMS), st.builds(messages.transform, STAMPS, TRIPLES)),
    st.tuples(
        st.just(definitions.STRING),
        st.builds(messages.record, st.dictionaries(st.text(), st.text() | st.integers() | st.booleans())),
    ),
)


def equal(read, written):
    """Return whether two contents are equal, numbers within the precision of 32 bits."""
    if isinstance(written, dict):
        return read.keys() == written.keys() and all(equal(read[name], written[name]) for name in written)
    if isinstance(written, list):
        return len(read) == len(written) and all(map(equal, read, written))
    if isinstance(written, float):
        return math.isclose(read, written, rel_tol=1e-7) or (math.isnan(read) and math.isnan(written))
    return type(read) is type(written) and read == written


@given(rows=st.lists(st.tuples(ROWS, STAMPS), max_size=10))
def test_each_message_is_read_back_equal(rows, tmp_path_factory):
    """A field that is missing or misspelled would be written as 0 without an error."""
    path = tmp_path_factory.mktemp("bag") / "log.mcap"
    with BagWriter(path, {"robot": "robotino-3"}) as bag:
        for (type_name, content), stamp_s in rows:
            bag.write(f"/{type_name}", type_name, content, stamp_s)

    read = read_bag(path)

    assert read.metadata == {"robot": "robotino-3"}
    assert not bag.part.exists()
    for type_name in definitions.TYPES:
        found = read.topics.get(f"/{type_name}", [])
        written = [(content, stamp_s) for (name, content), stamp_s in rows if name == type_name]
        assert [message.stamp_s for message in found] == [stamp_s for _, stamp_s in written]
        assert all(message.type_name == type_name for message in found)
        assert all(
            equal(message.content, content) for message, (content, _) in zip(found, written, strict=True)
        )


KILLED = """
import os, pathlib, signal, sys
from palaestra_trainer.bags import definitions, messages
from palaestra_trainer.bags.writer import BagWriter

bag = BagWriter(pathlib.Path(sys.argv[1]), {"robot": "robotino-3"})
for tenth in range(25):
    bag.write("/bump", definitions.BOOL, messages.bump(touched=tenth % 2 == 0), 100 + tenth / 10)
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.fixture
def killed(tmp_path):
    """Return the `.part` file of a writer that was killed after 2.4 s."""
    path = tmp_path / "log.mcap"
    ended = subprocess.run([sys.executable, "-c", KILLED, path], check=False, timeout=60)
    assert ended.returncode == -signal.SIGKILL
    assert not path.exists()
    return tmp_path / "log.mcap.part"


def test_a_crash_loses_less_than_the_last_second(killed):
    """A person finds the cause of a crash in the seconds before it."""
    read = read_bag(killed)

    assert read.metadata == {"robot": "robotino-3"}
    stamps = [message.stamp_s for message in read.topics["/bump"]]
    assert stamps == [100 + tenth / 10 for tenth in range(22)]


def test_the_log_of_a_crash_is_not_overwritten(killed):
    """A supervisor starts the program again, with the same arguments."""
    before = killed.read_bytes()

    with pytest.raises(ConfigurationError, match=r"log\.mcap\.part: exists.*mcap recover"):
        BagWriter(killed.with_suffix(""))

    assert killed.read_bytes() == before


def test_an_older_log_is_not_overwritten(tmp_path):
    """The log of an earlier drive may be the only one with a fault."""
    path = tmp_path / "log.mcap"
    path.write_bytes(b"earlier")

    with pytest.raises(ConfigurationError, match="exists; name a new file"):
        BagWriter(path)

    assert path.read_bytes() == b"earlier"
    assert list(tmp_path.iterdir()) == [path]


def drive_into_a_wall(bag):
    """Write a message and fail."""
    with bag:
        bag.write("/bump", definitions.BOOL, messages.bump(touched=True), 1.0)
        raise RuntimeError("the robot is stuck")


def test_an_error_of_the_program_completes_the_log(tmp_path):
    """The log of a drive that failed is the one that a person reads."""
    path = tmp_path / "log.mcap"
    bag = BagWriter(path)

    with pytest.raises(RuntimeError, match="stuck"):
        drive_into_a_wall(bag)
    bag.close()

    assert len(read_bag(path).topics["/bump"]) == 1


def test_a_clock_that_is_set_back_does_not_delay_the_flush(tmp_path):
    """A robot's clock is often wrong until it reaches a time server."""
    with BagWriter(tmp_path / "log.mcap") as bag:
        for stamp_s in (5000.0, 100.0):
            bag.write("/bump", definitions.BOOL, messages.bump(touched=True), stamp_s)

        assert [message.stamp_s for message in read_bag(bag.part).topics["/bump"]] == [5000.0, 100.0]


def test_a_topic_has_one_type(tmp_path):
    """A player reads all messages of a topic with the definition of its first one."""
    with BagWriter(tmp_path / "log.mcap") as bag:
        bag.write("/x", definitions.BOOL, messages.bump(touched=True), 1.0)

        with pytest.raises(ConfigurationError, match="so std_msgs/msg/String needs another topic"):
            bag.write("/x", definitions.STRING, messages.record({}), 1.0)
