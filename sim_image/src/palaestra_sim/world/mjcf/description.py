"""The robot of an MJCF world, as the elements `text` and `numeric` of `custom` describe it.

    <custom>
      <text name="controllerArgs" data="--name=cartpole --synchronize"/>
      <text name="robot" data="cartpole"/>
      <numeric name="basicTimeStep" data="10"/>
      <text name="device:actuator/slide" data="cart motor"/>
      <text name="device:sensor/debug" data="-"/>
    </custom>

All these elements are optional. MuJoCo itself ignores them.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Final

from palaestra_sim.errors import WorldError
from palaestra_sim.world.mjcf.elements import Element, read
from palaestra_sim.world.source import Source

ARGUMENTS: Final = "controllerArgs"
ROBOT: Final = "robot"
BASIC_STEP: Final = "basicTimeStep"
KEYFRAME: Final = "keyframe"
DEVICE: Final = "device:"
LEFT_OUT: Final = "-"  # name for a device that the user leaves out
DEVICE_KINDS: Final = ("actuator", "camera", "sensor")
_TIMESTEP_S: Final = 0.002  # MuJoCo's default
_LONGEST_MS: Final = 100  # largest default basic step; a longer one is too coarse for a robot
_MOST_STEPS: Final = 10_000  # steps of MuJoCo in a basic step; more would take seconds
# A message recommends two timesteps: 1/n ms and 1/(n + 1) ms. `_SHORTEST_PART` is the greatest n.
_SHORTEST_PART: Final = 99
_NEAR: Final = 1e-4  # relative tolerance: 0.0041666 s counts as 1/240 s
_BYTE_ORDER_MARK: Final = b"\xef\xbb\xbf"


@dataclass(frozen=True, slots=True, kw_only=True)
class Description:
    """An MJCF world as text.

    Attributes:
        source: the bytes of the file.
        root: the root of the elements.
        texts: the elements `text` of `custom` by name; if several have the same name, only the first.
        numbers: the elements `numeric` of `custom` by name; if several have the same name, only the first.
    """

    source: Source
    root: Element
    texts: Mapping[str, Element]
    numbers: Mapping[str, Element]
    # For each section, the byte at which each named element begins; a section is searched at its first use.
    _places: dict[str, dict[str, int]] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def robot(self) -> str:
        """The name of the robot: from `custom`, else the name of the model, else "robot"."""
        return self._text(ROBOT) or self.root.attributes.get("model") or "robot"

    @property
    def arguments(self) -> tuple[str, ...]:
        """The arguments of the controller."""
        return tuple(self._text(ARGUMENTS).split())

    @property
    def keyframe(self) -> str:
        """The name of the keyframe at which the world begins; "" for the model's initial positions."""
        return self._text(KEYFRAME)

    @property
    def devices(self) -> Mapping[str, str]:
        """The new names of devices, by the kind and the name in the model, such as "sensor/x"."""
        return {name.removeprefix(DEVICE): self._text(name) for name in self.texts if name.startswith(DEVICE)}

    @property
    def timestep_s(self) -> float:
        """The length of one MuJoCo step in seconds; MuJoCo's default if this file does not set it."""
        given = [it.attributes["timestep"] for it in self.root.named("option") if "timestep" in it.attributes]
        return _number(given[-1]) if given else _TIMESTEP_S

    @property
    def basic_step_ms(self) -> float | None:
        """The basic step that the world sets, in ms; None if the world does not set it."""
        element = self.numbers.get(BASIC_STEP)
        return None if element is None else _number(element.attributes.get("data", ""))

    def error(self, section: str, name: str, fact: str, remedy: str) -> WorldError:
        """Return an error at the element `name` of a section such as "sensor", or at the root without it."""
        if section not in self._places:
            elements = (it for section_ in self.root.named(section) for it in section_.walk())
            named = ((it.attributes.get("name", ""), it.start) for it in elements)
            self._places[section] = dict(reversed(list(named)))
        start = self._places[section].get(name, 0) if name else 0
        return self.source.error(start or self.root.start, fact, remedy)

    def _text(self, name: str) -> str:
        element = self.texts.get(name)
        return "" if element is None else element.attributes.get("data", "").strip()


def is_mjcf(source: bytes) -> bool:
    """Return whether a world is XML; other worlds begin with a hash."""
    return source.removeprefix(_BYTE_ORDER_MARK).lstrip().startswith(b"<")


def describe(source: bytes, name: str = "world") -> Description:
    """Return the description of an MJCF world.

    Raises:
        WorldError: the bytes are not an MJCF file.
    """
    origin = Source(data=source, name=name, kind="world")
    root = read(origin)
    if root.tag != "mujoco":
        fact = f"the root of the file is <{root.tag}>"
        raise origin.error(root.start, fact, "write a model of MuJoCo, whose root is <mujoco>")
    return Description(
        source=origin,
        root=root,
        texts=_by_name(root, "text"),
        numbers=_by_name(root, "numeric"),
    )


def custom(root: Element, tag: str) -> Iterator[tuple[str, Element]]:
    """Yield the elements of a tag in `custom`, with their names."""
    for element in root.named("custom", tag):
        if "name" in element.attributes:
            yield element.attributes["name"], element


def whole_step_ms(timestep_s: float) -> int | None:
    """Return the shortest time in ms that is a whole number of MuJoCo steps; None if it is too long."""
    return next((step_ms for step_ms in range(1, _LONGEST_MS + 1) if fits(step_ms, timestep_s)), None)


def fits(step_ms: float, timestep_s: float) -> bool:
    """Return whether a basic step is a whole number of milliseconds and of steps of MuJoCo."""
    if not step_ms >= 1.0 or step_ms != int(step_ms):
        return False
    steps = step_ms / (timestep_s * 1000.0)
    return 1 <= round(steps) <= _MOST_STEPS and abs(steps - round(steps)) < _NEAR * steps


def fitting_timesteps_s(timestep_s: float) -> tuple[float, float]:
    """Return the nearest shorter and longer timestep that fits a short basic step of whole milliseconds."""
    ms = timestep_s * 1000.0
    if ms >= 1.0:
        return int(ms) / 1000.0, (int(ms) + 1) / 1000.0
    steps = min(int(1.0 / ms), _SHORTEST_PART)
    return 0.001 / (steps + 1), 0.001 / steps


def with_parts(description: Description, parts: Iterable[Element]) -> Description:
    """Return the description of a model with several files, including the `custom` of each file.

    In errors, an element of another file has the position of this file's root.
    """
    texts, numbers = dict(description.texts), dict(description.numbers)
    for root in parts:
        for tag, found in (("text", texts), ("numeric", numbers)):
            for name, element in custom(root, tag):
                found.setdefault(name, replace(element, start=description.root.start))
    return replace(description, texts=texts, numbers=numbers)


def _by_name(root: Element, tag: str) -> dict[str, Element]:
    found: dict[str, Element] = {}
    for name, element in custom(root, tag):
        found.setdefault(name, element)
    return found


def _number(text: str) -> float:
    """Return the number in a text; NaN if the text is not one finite number."""
    words = re.findall(r"\S+", text)
    try:
        number = float(words[0]) if len(words) == 1 else math.nan
    except ValueError:
        return math.nan
    return number if math.isfinite(number) else math.nan
