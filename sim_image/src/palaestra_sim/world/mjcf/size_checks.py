"""Checks for elements that grow when MuJoCo reads them: copies, grids of points, and images.

MuJoCo allocates any size that such an element requests. So one line of text can use all memory, or take
minutes.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.world.mjcf.elements import Element
from palaestra_sim.world.source import Source

_MOST: Final[Mapping[str, int]] = {
    "replicate": 100_000,
    "composite": 100_000,
    "flexcomp": 1_000_000,
    "hfield": 16_000_000,
    "texture": 100_000_000,
    "camera": 1 << 26,
    "mesh": 40_000,
    "size": 1_000_000,
}
# For each element, the attributes whose numbers are multiplied to get the element's size.
_SIZES: Final[Mapping[str, tuple[str, ...]]] = {
    "replicate": ("count",),
    "composite": ("count",),
    "flexcomp": ("count",),
    "hfield": ("nrow", "ncol"),
    "texture": ("width", "height"),
    "camera": ("resolution",),
    "mesh": ("params",),
    "size": ("nuserdata",),
}
_REMEDY: Final = "make it smaller"


def growing(source: Source, root: Element) -> Iterator[WorldError]:
    """Yield an error for each element that would grow to too many copies, points or pixels."""
    waiting = [(root, 1.0)]
    while waiting:
        element, copies = waiting.pop()
        size = _size(element)
        if element.tag == "replicate":
            size = copies = copies * size
        if element.tag in _MOST and size > _MOST[element.tag]:
            fact = f"<{element.tag}> has the size {size:.3g}; the limit is {_MOST[element.tag]}"
            yield source.error(element.start, fact, _REMEDY)
        waiting += [(child, copies) for child in element.children]


def _size(element: Element) -> float:
    """Return the product of an element's size numbers; 1 without such numbers."""
    texts = [element.attributes.get(name, "") for name in _SIZES.get(element.tag, ())]
    numbers = [float(word) for text in texts for word in text.split() if word.isdigit()]
    if element.tag == "mesh":  # a built-in mesh has at most as many points as the square of its resolution
        return max(numbers, default=1.0) ** 2
    return math.prod(numbers)
