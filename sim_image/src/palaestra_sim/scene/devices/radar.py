"""Radar: its settings. The stub sends no radar waves, so `enable` answers failure."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from palaestra_sim.scene.devices.kind import Kind, Part, Topic, always_silent
from palaestra_sim.seam import Row

_ANSWERS: Final = {
    "get_min_range": ("minRange", 1.0),
    "get_max_range": ("maxRange", 50.0),
    "get_vertical_fov": ("verticalFieldOfView", 0.1),
    "get_horizontal_fov": ("horizontalFieldOfView", 0.78),
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Radar:
    """A radar that sees nothing; `settings` by the names of the services that answer them."""

    name: str
    model: str
    settings: dict[str, float]


def _read(part: Part) -> Radar:
    settings = {service: part.number(*field) for service, field in _ANSWERS.items()}
    return Radar(name=part.name, model=part.text("model"), settings=settings)


def _services(radar: Radar) -> tuple[Row, ...]:
    return tuple(
        (name, "get_float", lambda _, value=value: {"value": value}) for name, value in radar.settings.items()
    )


def _topics(_radar: Radar) -> tuple[Topic, ...]:
    return (
        Topic(name="targets", type_name="webots_ros/RadarTarget", source=None),
        Topic(name="number_of_targets", type_name="webots_ros/Int8Stamped", source=None),
    )


RADAR: Final = Kind(
    node="Radar",
    name="radar",
    fields="""minRange SFFloat 1; maxRange SFFloat 50; horizontalFieldOfView SFFloat 0.78;
        verticalFieldOfView SFFloat 0.1; minAbsoluteRadialSpeed SFFloat 0; minRadialSpeed SFFloat 1;
        maxRadialSpeed SFFloat -1; cellDistance SFFloat 0; cellSpeed SFFloat 0; rangeNoise SFFloat 0;
        speedNoise SFFloat 0; angularNoise SFFloat 0; antennaGain SFFloat 20; frequency SFFloat 24;
        transmittedPower SFFloat 1; minDetectableSignal SFFloat -100; occlusion SFBool FALSE""",
    read=_read,
    services=_services,
    topics=_topics,
    silent=always_silent,
)
