"""docs/judging.md shows the order in which a replica is judged; the code has it as one list."""

from pathlib import Path

from palaestra.decide.judging import JUDGED, Kind

PAGE = Path(__file__).parents[3] / "docs/judging.md"


def rows(text, columns):
    """Return the rows of the tables with so many columns, heads and rules left out."""
    lines = (line.strip("|").split("|") for line in text.splitlines() if line.startswith("|"))
    cells = [[cell.strip() for cell in line] for line in lines if len(line) == columns]
    return [row for row in cells if row[0].isdigit()]


def test_the_page_shows_the_list_in_its_order():
    """By class, name and first line of each check."""
    page = rows(PAGE.read_text(encoding="utf-8"), 4)

    assert page == [
        [str(number), kind.value, f"`{check.__name__}`", check.__doc__.strip().splitlines()[0]]
        for number, (kind, check) in enumerate(JUDGED, 1)
    ]


def test_each_check_is_in_the_list_once():
    """A check that is there twice holds at the first place only."""
    assert len({check for _, check in JUDGED}) == len(JUDGED)


def test_the_last_row_always_holds():
    """Whatever is seen of a replica, the status says where it stands."""
    assert JUDGED[-1][0] is Kind.SHOWN
