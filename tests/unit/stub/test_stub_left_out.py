"""The report about the nodes that a simulator leaves out."""

import pytest

from palaestra_sim.errors import WorldError
from palaestra_sim.ros_controller.left_out import left_out_lines, write_left_out


def error(line, fact="the stub simulates no Drone", world="my.wbt"):
    """Return the error for a node that was left out, at the beginning of a line."""
    return WorldError(world, line, 1, fact, "left out")


def test_nodes_of_a_kind_have_one_line_with_their_places() -> None:
    """A forest of trees is one fact."""
    assert list(left_out_lines([error(12), error(5, "no Sea"), error(40), error(40)])) == [
        "the stub simulates no Drone: 3 nodes left out (my.wbt, lines 12, 40)",
        "no Sea: 1 node left out (my.wbt, line 5)",
    ]


def test_many_places_are_counted() -> None:
    """A line of a status must be short."""
    [line] = left_out_lines([error(number) for number in range(1, 21)])

    assert line.endswith(": 20 nodes left out (my.wbt, lines 1, 2, 3, 4, 5, 6, 7, 8 and 12 more)")


def test_a_place_has_the_name_of_its_file() -> None:
    """The place may be in a PROTO, and a generated world has lines that its source lacks."""
    assert list(left_out_lines([error(3), error(3, world="Hall.proto")])) == [
        "the stub simulates no Drone: 1 node left out (my.wbt, line 3)",
        "the stub simulates no Drone: 1 node left out (Hall.proto, line 3)",
    ]


def test_a_report_is_written_whole_or_not_at_all(tmp_path) -> None:
    """A sidecar may read the file at any moment."""
    write_left_out([error(3)], tmp_path / "report")

    with pytest.raises(IsADirectoryError):
        write_left_out([error(3)], tmp_path)

    assert [path.name for path in tmp_path.iterdir()] == ["report"]
    assert (
        tmp_path / "report"
    ).read_text() == "the stub simulates no Drone: 1 node left out (my.wbt, line 3)\n"
