"""Pages with a generated section between two marks; people write the other sections."""

END = "<!-- end of the generated part -->"


def between_marks(text: str, begin: str, part: str) -> str:
    """Return the page `text` with `part` between the mark `begin` and the next `END`.

    Raises:
        ValueError: a mark is missing.
    """
    before, mark, rest = text.partition(begin)
    _, other_mark, after = rest.partition(END)
    if not (mark and other_mark):
        raise ValueError(f"the page lacks {begin} or the next {END}; add both")
    return f"{before}{begin}\n\n{part}\n{END}{after}"
