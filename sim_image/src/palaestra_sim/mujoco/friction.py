"""Set the friction between each pair of materials, although a geom of MuJoCo has only one friction.

If two geoms touch, MuJoCo uses the friction of the geom with the higher priority. Here, geoms of rarer
materials have higher priorities. The friction of a geom is the friction between its own material and the most
common material. This friction is wrong for some pairs of materials. For pairs of geoms with these materials,
the model has explicit entries with the right friction.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import Any, Final

from palaestra_sim.scene.physics_settings import PhysicsSettings

_WORLD: Final = "world"
_CONTACT: Final = 3  # MuJoCo's condim: a contact with sliding friction only
Surface = tuple[Any, str]  # a geom, and its material


def set_frictions(spec: Any, surfaces: Sequence[Surface], surroundings: PhysicsSettings) -> None:
    """Set the frictions of all geoms of a model that is not compiled yet, by their materials."""
    ranks = [material for material, _ in Counter(material for _, material in surfaces).most_common()]
    friction = {material: surroundings.friction(material, ranks[0]) for material in ranks}
    for geom, material in surfaces:
        geom.friction[0] = friction[material]
        geom.priority = ranks.index(material)
    for number, (geom, _) in enumerate(surfaces):
        geom.name = f"geom {number}"
    for one, other in _exceptions(spec, surfaces, friction, surroundings):
        wanted = surroundings.friction(one[1], other[1])
        geoms = one[0], other[0]
        rolling = geoms[0].friction
        spec.add_pair(
            geomname1=geoms[0].name,
            geomname2=geoms[1].name,
            condim=_CONTACT,
            friction=[wanted, wanted, rolling[1], rolling[2], rolling[2]],
        )


def _exceptions(
    spec: Any, surfaces: Sequence[Surface], friction: dict[str, float], surroundings: PhysicsSettings
) -> Iterator[tuple[Surface, Surface]]:
    """Yield the pairs of geoms that may touch, and whose priorities give the wrong friction."""
    ranks = list(friction)
    wrong = {
        frozenset((one, other))
        for at, one in enumerate(ranks)
        for other in ranks[at:]
        if surroundings.friction(one, other) != friction[other]
    }
    if not wrong:
        return
    apart = {frozenset((pair.bodyname1, pair.bodyname2)) for pair in spec.excludes}
    for one, other in combinations(surfaces, 2):
        if frozenset((one[1], other[1])) in wrong and _may_touch(one[0], other[0], apart):
            yield one, other


def _may_touch(one: Any, other: Any, apart: set[frozenset[str]]) -> bool:
    if not (one.contype & other.conaffinity or other.contype & one.conaffinity):
        return False
    bodies = one.parent, other.parent
    names = {body.name for body in bodies}
    around = {body.parent.name for body in bodies if body.parent is not None} - {_WORLD}
    return len(names) > 1 and frozenset(names) not in apart and not names & around
