"""The elements of an XML file, each with its bytes.

The author of the file is not trusted. So a document type is refused, because its entities could name a file
or expand without end.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Final
from xml.parsers import expat

from palaestra_sim.world.source import Source

_VALUE: Final = rb"\"[^\"]*\"|'[^']*'"
_START_TAG: Final = re.compile(rb"<[^\s/>]+(?:\s+[^\s=]+\s*=\s*(?:" + _VALUE + rb"))*\s*/?>")


@dataclass(frozen=True, slots=True, kw_only=True)
class Element:
    """One element.

    Attributes:
        tag: the name of the element.
        attributes: the unescaped values of the attributes, by name.
        start: the byte at which the start tag begins.
        children: the elements directly inside it, in the order of the file.
    """

    tag: str
    attributes: Mapping[str, str]
    start: int
    children: list[Element] = field(default_factory=list)

    def walk(self) -> Iterator[Element]:
        """Yield the element and all elements inside it, parents before children."""
        waiting: list[Element] = [self]
        while waiting:
            element = waiting.pop()
            yield element
            waiting.extend(reversed(element.children))

    def named(self, *tags: str) -> Iterator[Element]:
        """Yield the elements at a path of tags: `named("custom", "text")`."""
        for child in self.children:
            if child.tag == tags[0]:
                yield from child.named(*tags[1:]) if tags[1:] else (child,)


def read(source: Source) -> Element:
    """Return the root of a file.

    Raises:
        WorldError: the file is not well-formed XML in UTF-8, has a document type, or is nested too deep.
    """
    return _Reader(source).read()


def start_tag_end(source: Source, element: Element) -> int:
    """Return the byte after the start tag of an element."""
    return _start_tag(source, element).end()


def value_span(source: Source, element: Element, attribute: str) -> tuple[int, int]:
    """Return the span of an attribute's value in an element, with its quotes."""
    tag = _start_tag(source, element)
    pattern = re.compile(rb"\s" + re.escape(attribute.encode()) + rb"\s*=\s*(" + _VALUE + rb")")
    found = pattern.search(source.data, tag.start(), tag.end())
    if found is None:
        raise LookupError(f"{element.tag} has no {attribute}")
    return found.span(1)


_DEEPEST: Final = 200  # maximum depth of elements; the bodies of robots are nested about 20 deep


class _Reader:
    def __init__(self, source: Source) -> None:
        self._source = source
        self._open: list[Element] = []
        self._root: Element | None = None
        self._parser = expat.ParserCreate("utf-8")
        self._parser.StartElementHandler = self._start
        self._parser.EndElementHandler = self._end
        self._parser.StartDoctypeDeclHandler = self._refuse_document_type

    def read(self) -> Element:
        try:
            self._parser.Parse(self._source.data, True)
        except expat.ExpatError as error:
            fact = f"the file is not well-formed XML: {expat.ErrorString(error.code)}"
            raise self._source.error(self._parser.ErrorByteIndex, fact, "correct it here") from None
        if self._root is None:
            raise self._source.error(0, "the file has no element", "write a model: <mujoco> ... </mujoco>")
        return self._root

    def _start(self, tag: str, attributes: Mapping[str, str]) -> None:
        start = self._parser.CurrentByteIndex
        if len(self._open) > _DEEPEST:
            fact = f"elements are nested more than {_DEEPEST} deep"
            raise self._source.error(start, fact, "use fewer levels")
        element = Element(tag=tag, attributes=attributes, start=start)
        if self._open:
            self._open[-1].children.append(element)
        else:
            self._root = element
        self._open.append(element)

    def _end(self, _tag: str) -> None:
        self._open.pop()

    def _refuse_document_type(self, *_: object) -> None:
        fact = "the file has a document type (<!DOCTYPE), which could name other files"
        raise self._source.error(self._parser.CurrentByteIndex, fact, "remove it")


def _start_tag(source: Source, element: Element) -> re.Match[bytes]:
    tag = _START_TAG.match(source.data, element.start)
    if tag is None:  # cannot occur: the parser has found a start tag here
        raise LookupError(f"no start tag of {element.tag}")
    return tag
