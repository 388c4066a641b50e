"""Pages of which a part is generated: it stands between two marks, and the rest is written by people."""

END = "<!-- end of the generated part -->"


def between_marks(text: str, begin: str, part: str) -> str:
    """Return the page `text` with what stands between the mark `begin` and the next `END` replaced by `part`.

    Raises:
        ValueError: a mark is missing.
    """
    before, mark, rest = text.partition(begin)
    _, other_mark, after = rest.partition(END)
    if not (mark and other_mark):
        raise ValueError(f"no {begin} and {END} in the page; put both in")
    return f"{before}{begin}\n\n{part}\n{END}{after}"
