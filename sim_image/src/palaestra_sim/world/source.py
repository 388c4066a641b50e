"""The bytes of one world or PROTO file, and errors at positions in the file.

This package works with byte offsets, but people read lines and columns. Only this module converts an offset
to a line and a column, so every error of a world has both.
"""

import re
from dataclasses import dataclass, field
from typing import NamedTuple

from palaestra_sim.errors import WorldError

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"  # some editors put this mark at the start of a UTF-8 file
# Webots accepts blanks after the hash; PROTOs of drones have such blanks.
_RELEASE = re.compile(rb"#[ \t]*VRML_SIM R(?P<year>[0-9]{4})(?P<letter>[a-z]?)")
_CONTINUED = bytes(range(0x80, 0xC0))  # continuation bytes of UTF-8, which do not begin a character
_BLOCK = 4096  # bytes between two marks; a mark stores the line and column of its byte
_HEADER = re.compile(rb"#[ \t]*VRML_SIM [VR]?[0-9][^\s]*(?: utf8)?(?=[ \t]*\r?(?:\n|\Z))")


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """The bytes of a file, and its name in errors; `kind` is "world" or "PROTO".

    A `headless` source is not a file: a client sent it, without a first line, in the current syntax.
    """

    data: bytes
    name: str
    kind: str = "world"
    headless: bool = False
    _marks: list["_Mark"] = field(default_factory=list, init=False, repr=False, compare=False)

    @property
    def begin(self) -> int:
        """Return the offset of the first line, after a byte-order mark if the file has one."""
        return len(_BYTE_ORDER_MARK) if self.data.startswith(_BYTE_ORDER_MARK) else 0

    def header(self) -> str:
        """Return the first line, such as `#VRML_SIM R2023b utf8`.

        Raises:
            WorldError: the file is not UTF-8, or does not begin with such a line.
        """
        try:
            self.data.decode("utf-8")
        except UnicodeDecodeError as error:
            byte = self.data[error.start]
            fact = f"byte 0x{byte:02x} is not UTF-8"
            raise self.error(error.start, fact, f"save the {self.kind} as UTF-8") from None
        match = _HEADER.match(self.data, self.begin)
        if match is None:
            fact = f"the first line is not the header of a Webots {self.kind}"
            raise self.error(0, fact, "make it #VRML_SIM R2023b utf8")
        return match.group().decode()

    def older_than(self, year: int, letter: str) -> bool:
        """Return whether the file is of a release of Webots before R`year``letter`, such as R2022a."""
        match = _RELEASE.match(self.data, self.begin)
        if match is None:
            return not self.headless and _HEADER.match(self.data, self.begin) is not None
        return (int(match["year"]), match["letter"].decode()) < (year, letter)

    def error(self, offset: int, fact: str, remedy: str) -> WorldError:
        """Return an error at byte `offset`, for the caller to raise."""
        if not self._marks:
            self._marks.extend(_marked(self.data))
        line, column = _after(self._marks[offset // _BLOCK], self.data, offset)
        return WorldError(self.name, line + 1, column + 1, fact, remedy)


class _Mark(NamedTuple):
    """A position in a file: its offset, the lines before it, and the characters before it in its own line.

    A file has a mark for each block, so the conversion of an offset does not scan the whole file or a long
    line.
    """

    at: int
    line: int
    column: int


def _marked(data: bytes) -> list[_Mark]:
    """Return the marks of a file, one at the start of each block."""
    marks = [_Mark(0, 0, 0)]
    for at in range(_BLOCK, len(data) + 1, _BLOCK):
        marks.append(_Mark(at, *_after(marks[-1], data, at)))
    return marks


def _after(mark: _Mark, data: bytes, offset: int) -> tuple[int, int]:
    """Return line and column, from 0, of a byte between a mark and the next mark."""
    line = mark.line + data.count(b"\n", mark.at, offset)
    line_start = data.rfind(b"\n", mark.at, offset) + 1
    begins, before = (line_start, 0) if line_start else (mark.at, mark.column)
    return line, before + len(data[begins:offset].translate(None, _CONTINUED))
