"""The report of the nodes that a simulator leaves out of a world."""

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.ros_controller.left_out import left_out_lines, write_left_out


def error(line, fact="the stub simulates no Drone", world="my.wbt"):
    """Return the error about a left-out node in a line."""
    return WorldError(world, line, 1, fact, "left out")


def test_nodes_of_a_kind_have_one_line_with_their_places() -> None:
    """A person who reads the report needs one line about all trees of a forest."""
    assert list(left_out_lines([error(12), error(5, "no Sea"), error(40), error(40)])) == [
        "the stub simulates no Drone: 3 nodes left out (my.wbt, lines 12, 40)",
        "no Sea: 1 node left out (my.wbt, line 5)",
    ]


def test_many_places_are_counted() -> None:
    """A line of a status must be short, so it has at most eight line numbers."""
    [line] = left_out_lines([error(number) for number in range(1, 21)])

    assert line.endswith(": 20 nodes left out (my.wbt, lines 1, 2, 3, 4, 5, 6, 7, 8 and 12 more)")


def test_a_place_has_the_name_of_its_file() -> None:
    """The node may be in a PROTO, and a generated world has more lines than its source."""
    assert list(left_out_lines([error(3), error(3, world="Hall.proto")])) == [
        "the stub simulates no Drone: 1 node left out (my.wbt, line 3)",
        "the stub simulates no Drone: 1 node left out (Hall.proto, line 3)",
    ]


def test_a_report_is_written_whole_or_not_at_all(tmp_path) -> None:
    """A sidecar may read the file at any moment, so the file must never be incomplete."""
    write_left_out([error(3)], tmp_path / "report")

    with pytest.raises(IsADirectoryError):
        write_left_out([error(3)], tmp_path)

    assert [path.name for path in tmp_path.iterdir()] == ["report"]
    assert (
        tmp_path / "report"
    ).read_text() == "the stub simulates no Drone: 1 node left out (my.wbt, line 3)\n"
