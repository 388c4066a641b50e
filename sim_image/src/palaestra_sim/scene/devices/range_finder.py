"""RangeFinder: its settings. The stub renders no depths, so `enable` and `save_image` answer failure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.devices.kind import Kind, Part, Topic, never
from palaestra_sim.seam import Fields, Row


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class RangeFinder:
    """A depth camera that sees nothing; `info` is what `get_info` answers."""

    name: str
    model: str
    info: Fields


def _read(part: Part) -> RangeFinder:
    info = {
        "width": int(part.number("width", 64.0)),
        "height": int(part.number("height", 64.0)),
        "Fov": part.number("fieldOfView", 0.7854),
        "minRange": part.number("minRange", 0.01),
        "maxRange": part.number("maxRange", 1.0),
    }
    return RangeFinder(name=part.name, model=part.text("model"), info=info)


def _services(finder: RangeFinder) -> tuple[Row, ...]:
    return (
        ("get_info", "range_finder_get_info", lambda _: finder.info),
        ("save_image", "save_image", lambda _: {"success": 0}),
    )


def _topics(_finder: RangeFinder) -> tuple[Topic, ...]:
    return (Topic(name="range_image", type_name="sensor_msgs/Image", source=None),)


RANGE_FINDER: Final = Kind(
    node="RangeFinder",
    name="range-finder",
    fields="""fieldOfView SFFloat 0.7854; width SFInt32 64; height SFInt32 64; spherical SFBool FALSE;
        near SFFloat 0.01; minRange SFFloat 0.01; maxRange SFFloat 1; motionBlur SFFloat 0;
        noise SFFloat 0; resolution SFFloat -1; lens SFNode""",
    read=_read,
    services=_services,
    topics=_topics,
    enable=never,
)
